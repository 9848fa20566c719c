//! Closest hit, occlusion and exact fan queries over a bounding volume hierarchy.
