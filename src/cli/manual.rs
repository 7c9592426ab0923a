//! `romc manual` and `romc completions`: the commands described for `man` and for shells.

use std::path::Path;

use clap::CommandFactory as _;
use serde_json::json;

use super::Answer;
use super::args::{Arguments, CompletionsArguments, ManualArguments};
use super::output::names;
use crate::Error;
use crate::files::{EmittedFile, write_files};

pub(crate) fn pages(arguments: &ManualArguments) -> Result<Answer, Error> {
    let mut root = Arguments::command();
    root.build();
    let mut files = vec![file(&arguments.out_dir, "romc", root.clone())?];
    for command in root.get_subcommands() {
        if command.get_name() == "help" {
            continue;
        }
        let name = format!("romc-{}", command.get_name());
        files.push(file(&arguments.out_dir, &name, command.clone())?);
    }
    let written = write_files(&arguments.out_dir, &files, arguments.force)?;
    let paths = names(&written);
    let text = format!("{}\n", paths.join("\n"));
    Ok(Answer::new(text, json!({ "files": paths })))
}

fn file(folder: &Path, name: &str, command: clap::Command) -> Result<EmittedFile, Error> {
    let path = format!("{name}.1");
    let mut page = Vec::new();
    clap_mangen::Man::new(command.display_name(name.to_owned()))
        .title(name.to_uppercase())
        // a date would make every build's pages differ
        .date("")
        .render(&mut page)
        .map_err(|source| Error::Write {
            path: folder.join(&path),
            source,
        })?;
    Ok(EmittedFile::new(path, String::from_utf8_lossy(&page)))
}

pub(crate) fn completions(arguments: &CompletionsArguments) -> Answer {
    let mut script = Vec::new();
    let mut command = Arguments::command();
    clap_complete::generate(arguments.shell, &mut command, "romc", &mut script);
    // Where names are offered that may also be files, bash offers both.
    let robots = crate::robot_file::known_names().join(" ");
    let names = format!("compgen -W \"{robots}\"");
    let text =
        String::from_utf8_lossy(&script).replace(&names, &format!("compgen -f -W \"{robots}\""));
    let json = json!({ "shell": arguments.shell.to_string(), "script": text });
    Answer::new(text, json)
}
