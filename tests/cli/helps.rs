//! The two helps of every command: their size, their width, and a default for every option with a value.

use super::{commands, done};

const SHORT: usize = 80; // lines of `-h` at most
const FULL: usize = 160; // lines of `--help` at most
const WIDTH: usize = 100;
const WORDS: usize = 25; // of a sentence at most

/// An option or argument of a help: its name with its value, and its text.
struct Entry {
    head: String,
    text: String,
}

impl Entry {
    /// Of a help in two columns: an entry begins with at most six blanks, its further lines with more.
    fn all(help: &str) -> Vec<Self> {
        let mut entries: Vec<Self> = Vec::new();
        let listed = help.lines().take_while(|line| !line.contains("--version"));
        for line in listed.filter(|line| line.starts_with("  ")) {
            let text = line.trim_start();
            let is_entry = line.len() - text.len() <= 6 && text.starts_with(['-', '<', '[']);
            match (text.split_once("  "), entries.last_mut()) {
                (Some((head, text)), _) if is_entry => entries.push(Self {
                    head: head.to_owned(),
                    text: text.trim().to_owned(),
                }),
                (_, Some(Self { text: begun, .. })) => {
                    let separator = if text.starts_with("- ") { '\n' } else { ' ' };
                    begun.push(separator);
                    begun.push_str(text);
                }
                (_, None) => {} // the usage
            }
        }
        entries
    }

    fn has_value(&self) -> bool {
        self.head.starts_with('-') && self.head.contains('<')
    }

    /// The text without defaults and possible values, line by line and sentence by sentence.
    fn sentences(&self) -> Vec<String> {
        let mut rest = self.text.as_str();
        let mut plain = String::new();
        while let Some((before, after)) = rest.split_once('[') {
            plain.push_str(before);
            rest = after.split_once(']').map_or("", |(_, after)| after);
        }
        plain.push_str(rest);
        let lines = plain.lines().flat_map(|line| line.split(". "));
        lines.map(str::to_owned).collect()
    }
}

#[test]
fn helps_are_short_enough_and_state_every_default() {
    let mut options = 0;
    for command in commands() {
        let [short, full] = ["-h", "--help"].map(|flag| done(&[&command, flag]));
        assert_eq!(done(&["help", &command]), full);
        for (help, most) in [(&short, SHORT), (&full, FULL)] {
            assert!(help.lines().count() <= most, "{command}: {help}");
            assert!(!help.contains("unless given"), "{command}: {help}");
            let widest = help.lines().map(|line| line.chars().count()).max();
            assert!(widest <= Some(WIDTH), "{command}: {help}");
        }
        let usage = full.lines().skip_while(|line| !line.starts_with("Usage: "));
        let usage: String = usage.take_while(|line| !line.is_empty()).collect();
        let usage = usage.replace("[OPTIONS] ", "");
        for entry in Entry::all(&full) {
            let Entry { head, text } = &entry;
            for sentence in entry.sentences() {
                let words = sentence.split_whitespace().count();
                assert!(
                    words <= WORDS,
                    "{command} {head}: {words} words: {sentence}"
                );
            }
            if entry.has_value() {
                options += 1;
                let is_stated = text.contains("[default: ") || text.contains("[required");
                assert!(
                    is_stated || usage.contains(head),
                    "{command} {head}: {text}"
                );
            }
        }
        let hidden = full.lines().count() > short.lines().count() + 20;
        assert!(!hidden || short.contains("This is a selection"), "{short}");
    }
    assert!(options > 120, "{options} options were found");
}
