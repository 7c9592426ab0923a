//! `romc manual` and `romc completions`: the commands described for `man` and for shells.

use clap::CommandFactory as _;

use super::*;

pub(super) fn pages(arguments: &ManualArguments) -> Result<Answer> {
    let mut root = Arguments::command();
    root.build();
    let commands = root.get_subcommands().filter(|of| of.get_name() != "help");
    let commands = commands.map(|command| (format!("romc-{}", command.get_name()), command));
    let files = std::iter::once(("romc".to_owned(), &root))
        .chain(commands)
        .map(|(name, command)| {
            let path = format!("{name}.1");
            let mut page = Vec::new();
            clap_mangen::Man::new(command.clone().display_name(name.clone()))
                .title(name.to_uppercase())
                // a date would make every build's pages differ
                .date("")
                .render(&mut page)
                .map_err(|source| Error::Write {
                    path: arguments.out_dir.join(&path),
                    source,
                })?;
            Ok(EmittedFile::new(path, String::from_utf8_lossy(&page)))
        });
    let files = files.collect::<Result<Vec<_>>>()?;
    let paths = names(&write_files(&arguments.out_dir, &files, arguments.force)?);
    let text = format!("{}\n", paths.join("\n"));
    Ok(Answer::new(text, json!({ "files": paths })))
}

pub(super) fn completions(arguments: &CompletionsArguments) -> Answer {
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
