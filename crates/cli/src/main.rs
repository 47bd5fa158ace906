//! The program `catseye`.

fn main() -> std::process::ExitCode {
    catseye_cli::run()
}
