//! Built-in scenes, made by formulas.
