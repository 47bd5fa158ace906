//! `catseye completions`: what a shell needs to complete the command line.

use catseye::base::error::{Error, Result};
use clap::Args;
use clap_complete::Shell;
use std::io::Write as _;

/// Print the shell script that completes commands and options
#[derive(Debug, Args)]
#[command(after_help = "For bash, in the current shell: source <(catseye completions bash)")]
pub struct Completions {
    /// Shell
    #[arg(value_name = "bash|zsh|fish|elvish|powershell")]
    pub shell: Shell,
}

impl Completions {
    /// `root` is the whole command line.
    pub fn run(&self, mut root: clap::Command) -> Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut root, "catseye", &mut script);
        let printed = std::io::stdout().write_all(&script);
        printed.map_err(|e| Error::io("stdout", e))
    }
}
