//! Commands `completions`, `man` and `schema`: what shells, manuals and editors want to know.

use crate::cli::args::Cli;
use crate::cli::failure::Failure;
use crate::cli::output::say;
use clap::{Args, CommandFactory};
use isospline_artifact::{Durability, write_file_atomic};
use std::path::{Path, PathBuf};

/// What `completions --help` ends with.
pub(crate) const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  isospline completions bash > ~/.local/share/bash-completion/completions/isospline
  isospline completions zsh > ~/.zfunc/_isospline
  isospline completions fish > ~/.config/fish/completions/isospline.fish";

/// What `man --help` ends with.
pub(crate) const MAN_EXAMPLES: &str = "\
Examples:
  isospline man | man -l -
  isospline man export | man -l -
  isospline man --out ~/.local/share/man/man1";

/// What `schema --help` ends with.
pub(crate) const SCHEMA_EXAMPLES: &str = "\
Examples:
  isospline schema > isospline.schema.json

With the line `#:schema ./isospline.schema.json` at the top of a model file, editors that know TOML
(Even Better TOML, taplo) complete keys, show what they mean and underline what is wrong.";

#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// The command; default: the page of isospline itself
    pub(crate) command: Option<String>,
    /// Write the pages of all commands into this folder
    #[arg(long, value_name = "DIR", conflicts_with = "command")]
    pub(crate) out: Option<PathBuf>,
}

/// Prints the completions for a shell.
pub(crate) fn completions(args: &CompletionsArgs) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "isospline", &mut script);
    print(&script)
}

/// Prints a manual page, or writes all of them.
pub(crate) fn man(args: &ManArgs) -> Result<u8, Failure> {
    let program = Cli::command().disable_help_subcommand(true);
    if let Some(folder) = &args.out {
        write_page(folder, "isospline", program.clone())?;
        for command in program.get_subcommands() {
            let name = format!("isospline-{}", command.get_name());
            write_page(folder, &name, titled(command, &name))?;
        }
        return say(&format!("pages of all commands are in {}", folder.display())).map(|()| 0);
    }
    let Some(name) = &args.command else { return print(&page(program)?) };
    let command = program.find_subcommand(name).ok_or_else(|| {
        let names: Vec<&str> = program.get_subcommands().map(clap::Command::get_name).collect();
        let help = format!("commands are {}", names.join(", "));
        Failure::usage(format!("there is no command {name:?}")).helped(help)
    })?;
    print(&page(titled(command, &format!("isospline-{name}")))?)
}

/// Prints the JSON Schema of model files.
pub(crate) fn schema() -> Result<u8, Failure> {
    let text = serde_json::to_string_pretty(&isospline::config::schema());
    say(&text.expect("invariant: a schema is plain data")).map(|()| 0)
}

fn print(bytes: &[u8]) -> Result<u8, Failure> {
    say(String::from_utf8_lossy(bytes).trim_end()).map(|()| 0)
}

/// A command under the name of its page, called as users call it.
fn titled(command: &clap::Command, name: &str) -> clap::Command {
    let call = name.replacen('-', " ", 1);
    command.clone().display_name(name).bin_name(call).version(env!("CARGO_PKG_VERSION"))
}

fn page(command: clap::Command) -> Result<Vec<u8>, Failure> {
    let mut page = Vec::new();
    let written = clap_mangen::Man::new(command).render(&mut page);
    written.map_err(|error| Failure::io(format!("cannot make the page: {error}")))?;
    Ok(page)
}

fn write_page(folder: &Path, name: &str, command: clap::Command) -> Result<(), Failure> {
    let page = page(command)?;
    let path = folder.join(format!("{name}.1"));
    Ok(write_file_atomic(&path, Durability::Fast, |out| out.write_all(&page))?)
}
