//! The edge-and-point image: rasterised edges, reachability, interpolation and anti-aliasing.
