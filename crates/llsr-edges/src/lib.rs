//! Silhouettes, creases and shadow edges of linear lights.
