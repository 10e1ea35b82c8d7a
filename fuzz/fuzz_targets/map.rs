#![no_main]
//! See `docs/stability.md`.

#[path = "../../tests/corpus/targets.rs"]
#[allow(dead_code)]
mod targets;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let _ = targets::map(data);
});
