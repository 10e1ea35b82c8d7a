//! How even a set of directions is.
