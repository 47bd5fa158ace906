fn main() -> std::process::ExitCode {
    catseye::cli::run()
}
