//! glTF import and export.
