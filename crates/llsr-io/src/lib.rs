//! Scene and image files: OBJ, glTF, PNG and multi-layer EXR, with untrusted input checked first.
