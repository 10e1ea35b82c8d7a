//! Final gathering against closed forms and brute force.
