//! The pyramid against brute force.
