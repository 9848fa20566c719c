//! Scenes for linear-light rendering: meshes, primitives, lights, cameras and the visibility interface.
