//! `catseye mcp`: the server that assistants call, by the Model Context Protocol over stdin and stdout.

#[cfg(feature = "mcp")]
mod arguments;
#[cfg(feature = "mcp")]
mod check;
#[cfg(feature = "mcp")]
mod describe;
#[cfg(feature = "mcp")]
mod keys;
#[cfg(feature = "mcp")]
mod program;
#[cfg(feature = "mcp")]
mod root;
#[cfg(feature = "mcp")]
mod server;
#[cfg(feature = "mcp")]
mod tools;

use super::global::Global;
use catseye::base::error::Result;
use clap::Args;
use std::path::PathBuf;

/// Serve assistants by the Model Context Protocol on stdin and stdout (needs a build with `--features mcp`)
#[derive(Debug, Args)]
#[command(after_help = "Configuration of a client, which starts the server: \
                  {\"mcpServers\": {\"catseye\": {\"command\": \"catseye\", \"args\": [\"mcp\"]}}}. \
                  The server ends when its stdin is closed. Tools: rcs, simulate, describe, list_keys, validate_file, examples.")]
pub struct Mcp {
    /// Root folder of all files that tools read and write; paths are relative to it
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub root: PathBuf,
}

#[cfg(not(feature = "mcp"))]
impl Mcp {
    pub fn run(&self, _: &Global) -> Result<()> {
        Err(catseye::base::error::BadInput::new("this program was built without the server for assistants")
            .key("mcp")
            .remedy("use an archive of a release, or cargo install --path crates/cli --locked --features mcp")
            .into())
    }
}

#[cfg(feature = "mcp")]
impl Mcp {
    pub fn run(&self, global: &Global) -> Result<()> {
        let root = root::Root::enter(&self.root)?;
        let program = program::Program::new(global, &root)?;
        server::serve(tools::Tools { root, program }, global)
    }
}
