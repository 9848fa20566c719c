//! Outward-rounded intervals, interval vectors and the pruning tree for edges and faces.
