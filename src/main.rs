//! The `cusp` binary: a thin shell over the library.

fn main() -> std::process::ExitCode {
    cusp::cli::main(std::env::args_os())
}
