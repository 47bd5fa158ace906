//! `catseye man`: the pages of the system's manual, made from the help of the commands.

use super::global::{Global, print_json};
use catseye::base::error::{BadInput, Error, Result, nearest};
use catseye::formats::stage;
use clap::Args;
use std::io::Write as _;
use std::path::PathBuf;

/// Print a manual page (troff), or write the pages of all commands into a folder
#[derive(Debug, Args)]
#[command(after_help = "To read a page at once: catseye man simulate | man -l -")]
pub struct Man {
    /// A command, with its subcommand if any (`learn train`) [default: the program]
    #[arg(value_name = "COMMAND", conflicts_with = "output")]
    pub command: Vec<String>,
    /// Folder for all pages, such as ~/.local/share/man/man1; other files in it are kept
    #[arg(short, long, visible_alias = "out", value_name = "DIR")]
    pub output: Option<PathBuf>,
}

/// The page of a command, in troff.
fn page(command: &clap::Command) -> Result<Vec<u8>> {
    let mut page = Vec::new();
    let rendered = clap_mangen::Man::new(command.clone()).manual("catseye").render(&mut page);
    rendered.map_err(|e| Error::Failed(format!("page of {}: {e}", command.get_name())))?;
    Ok(page)
}

/// The pages of a command and of all below it, with the names of their files.
fn pages(command: &clap::Command, found: &mut Vec<(String, Vec<u8>)>) -> Result<()> {
    let name = command.get_display_name().unwrap_or(command.get_name());
    found.push((format!("{name}.1"), page(command)?));
    command.get_subcommands().try_for_each(|below| pages(below, found))
}

/// The command that these words name.
fn named<'a>(root: &'a clap::Command, words: &[String]) -> Result<&'a clap::Command> {
    let mut at = root;
    for word in words {
        let names = || at.get_subcommands().map(clap::Command::get_name);
        at = at.find_subcommand(word).ok_or_else(|| {
            let bad = BadInput::new("is not a command").key("COMMAND").value(format!("'{word}'"));
            let bad = match names().next() {
                Some(_) => bad.allowed(names().collect::<Vec<_>>().join(", ")),
                None => bad.allowed(format!("nothing after '{}'", at.get_name())),
            };
            match nearest(word, names()) {
                Some(n) => bad.remedy(format!("did you mean '{n}'?")),
                None => bad,
            }
        })?;
    }
    Ok(at)
}

impl Man {
    /// `root` is the whole command line.
    pub fn run(&self, global: &Global, mut root: clap::Command) -> Result<()> {
        root.build();
        let Some(folder) = &self.output else {
            let page = page(named(&root, &self.command)?)?;
            return match global.json {
                true => print_json(&serde_json::json!({ "text": String::from_utf8_lossy(&page) })),
                false => std::io::stdout().write_all(&page).map_err(|e| Error::io("stdout", e)),
            };
        };
        let mut all = Vec::new();
        pages(&root, &mut all)?;
        let places: Vec<PathBuf> = all.iter().map(|(name, _)| folder.join(name)).collect();
        // All or none: an old page beside new ones would describe another program.
        let old = places.iter().find(|p| p.exists() && !global.force);
        if let Some(old) = old {
            return Err(BadInput::new("exists").file(old).remedy("use --force to replace it").into());
        }
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
        for (place, (_, page)) in places.iter().zip(&all) {
            stage::write_file(place, global.force, page)?;
        }
        let object = serde_json::json!({ "folder": folder.display().to_string(), "pages": all.len() });
        global.answer(&object, || format!("wrote {} pages into {}", all.len(), folder.display()))
    }
}
