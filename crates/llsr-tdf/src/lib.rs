//! Two-discontinuity finder, Voronoi search and a finder for any number of visibility changes.
