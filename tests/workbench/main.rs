//! The workbench as it looks: pictures of it, drawn by the CPU painter and compared bit for bit.

#![allow(clippy::expect_used, clippy::panic, missing_docs, reason = "a failed expectation is how this program reports")]

mod painter;
mod renderer;
