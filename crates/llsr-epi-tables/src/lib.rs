//! Generator of the lookup tables of the edge-and-point image.
