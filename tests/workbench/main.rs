//! The workbench: what a user does in it, whether what it shows is true, its threads, and how it looks. It is driven
//! without window or GPU; pictures are drawn by the CPU painter and compared bit for bit.

#![allow(clippy::expect_used, clippy::panic, missing_docs, reason = "a failed expectation is how this program reports")]

mod acts;
mod gathering;
mod painter;
mod pictures;
mod realtime;
mod refusals;
mod renderer;
mod threads;
mod truth;
mod window;
