//! Flags without effect, and numbers outside the range of their flag, are refused by name.

use std::collections::BTreeSet;

use clap::error::ErrorKind;
use clap::{CommandFactory as _, Parser as _};

use super::Arguments;
use super::args::Command;
use romc::Error;
use romc::limits::{Range, table};

/// Command lines with a flag that has no effect there, and that flag.
const IDLE: [(&str, &str); 34] = [
    (
        "plan m.json --distance 0.3 --apex 0.1 --output p.csv --yaw-rate 0.1",
        "--yaw-rate",
    ),
    ("plan m.json --reach --duration 2", "--duration"),
    (
        "compile m.json --out-dir o --emit latex --precision f32",
        "--precision",
    ),
    (
        "compile m.json --out-dir o --emit python --sincos library",
        "--sincos",
    ),
    (
        "compile m.json --out-dir o --emit latex --units scaled",
        "--units scaled",
    ),
    (
        "compile m.json --out-dir o --emit controller --units physical",
        "--units physical",
    ),
    ("compile m.json --out-dir o --emit c --digits 3", "--digits"),
    (
        "compile m.json --out-dir o --emit c,rust --significant 3",
        "--significant",
    ),
    (
        "compile m.json --out-dir o --emit c --rename z1=x",
        "--rename",
    ),
    (
        "compile m.json --out-dir o --emit python --width 22",
        "--width",
    ),
    (
        "compile m.json --out-dir o --emit markdown --form align",
        "--form",
    ),
    (
        "compile m.json --out-dir o --emit mathml --siunitx",
        "--siunitx",
    ),
    ("compile m.json --out-dir o --columns c.toml", "--columns"),
    ("compile m.json --out-dir o --clock recorded", "--clock"),
    (
        "compile m.json --out-dir o --domain r.toml --clock recorded",
        "--clock",
    ),
    ("inspect m.json --robot go2", "--robot"),
    ("inspect m.json --columns c.toml", "--columns"),
    ("inspect m.json --clock repaired", "--clock"),
    ("inspect --guess log.csv --clock repaired", "--clock"),
    ("check a.json b.txt --exact", "--exact"),
    ("check a.json b.txt --symbols z1=x", "--symbols"),
    (
        "mpc m.json r.csv --lift consistent --torque-rate 100",
        "--torque-rate",
    ),
    ("plan m.json --reach --columns c.toml", "--columns"),
    (
        "plan m.json --distance 0.3 --apex 0.1 --output p.csv --clock recorded",
        "--clock",
    ),
    ("import e.txt --output m.json --symbols z1=x", "--symbols"),
    ("import e.tex --output m.json --robot go1", "--robot"),
    ("import e.txt --output m.json --scaling 0.1", "--scaling"),
    (
        "import e.tex --output m.json --activation elu",
        "--activation",
    ),
    (
        "import e.txt --output m.json --robot go1 --order body,fl,fr,rl,rr",
        "--order",
    ),
    ("import n.npz --output m.json --columns c.toml", "--columns"),
    ("robot go1 --feet a,b,c,d", "--feet"),
    ("study --merge a b --columns c.toml", "--columns"),
    ("study --merge a b --clock recorded", "--clock"),
    ("import n.npz --output m.json --clock repaired", "--clock"),
];

/// The same flags where they have an effect.
const USED: [&str; 12] = [
    "compile m.json --out-dir o --emit c --precision f32 --units scaled --sincos library",
    "compile m.json --out-dir o --emit latex --digits 3 --rename z1=x --form align --siunitx",
    "compile m.json --out-dir o --emit c --digits 3 --domain r.csv --clock recorded",
    "compile m.json --out-dir o --emit markdown --units physical --width 22",
    "compile m.json --out-dir o --emit controller-c --plan p.csv --columns c.toml",
    "inspect m.json r.csv --robot go2 --columns c.toml --clock repaired",
    "check a.json b.tex --exact --symbols z1=x",
    "mpc m.json r.csv --torque-rate 100",
    "plan m.json --distance 0.3 --apex 0.1 --output p.csv --start r.csv --clock recorded",
    "plan m.json --distance 0.3 --apex 0.1 --figures f",
    "import n.npz --output m.json --robot go1 --order body,fl,fr,rl,rr --inputs-from r.csv --clock recorded",
    "robot r.urdf --feet a,b,c,d",
];

fn parsed(line: &str) -> Arguments {
    let words = ["romc"].into_iter().chain(line.split(' '));
    let parsed = Arguments::try_parse_from(words);
    parsed.unwrap_or_else(|error| panic!("{line}: {error}"))
}

#[test]
fn a_flag_without_effect_is_refused_by_name_and_one_with_effect_is_not() {
    for (line, idle) in IDLE {
        match parsed(line).refuse_idle() {
            Err(error @ Error::Idle { flag, .. }) => {
                assert_eq!(flag, idle, "{line}");
                assert!(error.is_usage());
            }
            other => panic!("{line}: {other:?}"),
        }
    }
    for line in USED {
        parsed(line)
            .refuse_idle()
            .unwrap_or_else(|error| panic!("{line}: {error}"));
    }
}

/// Flags that always have an effect, or that clap or the command refuses where they have none.
const ELSEWHERE: &str = "json help version force output out-dir \
    demo: verbose compile: emit as-learned tolerance domain margin save-model plan \
    inspect: guess robot: name check: domain convert: inputs-of clock columns identify: robot clock columns \
    simulate: restart-every verbose clock columns mpc: horizon step lift reference-input solver figures clock columns \
    plan: distance apex start figures reach settings speed \
    report: log study figures plan restart-every tolerance clock columns \
    import: format map weights xi-layout library library-order latent-dim phase input-scaling wrench-frame \
    actuators sample-time inputs-from unchecked name description \
    train: from validation test split config latent-dim method robot paper seed seeds epochs encoder-layers \
    decoder-layers activation lift-weight body-weight bptt-weight bptt-window bptt-stride bptt-decay \
    bptt-integrator slack refinements growth body body-equations mirror-images leave-out no-rotation degree trigonometric terms actuators wrench-frame phases phase \
    leave-out-implausible accelerations smooth smooth-rows moving-average mask-std mask-input-share coordinates state-scaling \
    torque-scaling force-scaling moment-scaling name clock columns verbose \
    study: validation latent-dims seeds method paper robot config lambda shard merge";

#[test]
fn every_flag_is_in_the_table_or_known_to_be_used_or_refused_elsewhere() {
    let mut known = BTreeSet::new();
    let mut command = "";
    for word in ELSEWHERE.split_whitespace() {
        match word.strip_suffix(':') {
            Some(name) => command = name,
            None => drop(known.insert((command, word))),
        }
    }
    for (line, flag) in IDLE {
        let command = line.split(' ').next().expect("a command");
        let flag = flag.trim_start_matches("--").split(' ').next();
        known.insert((command, flag.expect("a flag")));
    }
    for command in Arguments::command().get_subcommands() {
        for flag in command.get_arguments().filter_map(clap::Arg::get_long) {
            let name = command.get_name();
            let is_known = known.contains(&(name, flag)) || known.contains(&("", flag));
            assert!(is_known, "--{flag} of {name}: can it be without effect?");
        }
    }
}

/// Flags with a number but without a range in the table: any seed is valid.
const WITHOUT: [&str; 1] = ["seed"];

fn range(command: &str, flag: &str) -> Option<Range> {
    match (command, flag) {
        ("import", "latent-dim") => Some(table::IMPORTED_LATENT_DIM),
        (_, flag) if flag.ends_with("-layers") => Some(table::LAYER_WIDTH),
        (_, flag) => table::of_training(flag).copied(),
    }
}

/// Whether a command refuses this value of a flag.
fn refuses(command: &str, flag: &str, value: &str) -> bool {
    let flag = format!("--{flag}={value}");
    let found = Arguments::command().try_get_matches_from(["romc", command, &flag]);
    found.is_err_and(|error| error.kind() == ErrorKind::ValueValidation)
}

#[test]
fn every_flag_that_takes_a_number_refuses_what_lies_outside_its_range() {
    let mut met = BTreeSet::new();
    for command in Arguments::command().get_subcommands() {
        let name = command.get_name();
        let flags = command
            .get_arguments()
            .filter_map(|argument| argument.get_long());
        for flag in flags.filter(|flag| !WITHOUT.contains(flag)) {
            let takes_one_of = |values: [&str; 3]| {
                let mut values = values.into_iter();
                values.any(|value| !refuses(name, flag, value))
            };
            let takes_numbers = refuses(name, flag, "words")
                && takes_one_of(["1", "0.5", "3"])
                && !takes_one_of(["1%", "1..2", "x=1"]);
            if !takes_numbers {
                continue;
            }
            let range = range(name, flag);
            let range = range.unwrap_or_else(|| panic!("--{flag} of {name} has no range"));
            met.insert(range.name);
            let (least, most) = (range.least, range.most);
            assert!(!refuses(name, flag, &most.to_string()), "--{flag}={most}");
            let outside = match range.check(least + 0.5).is_err() {
                true => [least - 1.0, most + 1.0],
                false => [least - 1e-9 * most, most * (1.0 + 1e-9)],
            };
            for value in outside.into_iter().chain([f64::NAN, 1e300]) {
                let value = value.to_string();
                assert!(refuses(name, flag, &value), "--{flag}={value} of {name}");
            }
        }
    }
    assert!(met.len() >= 25, "{met:?}");
}

/// All options of a training with these flags of `romc train`, as text.
fn training(flags: &str) -> String {
    let line = format!("train r.csv --latent-dim 4 --output m.json {flags}");
    let Command::Train(arguments) = parsed(line.trim_end()).command else {
        panic!("{line}: another command");
    };
    let (settings, robot) = (arguments.settings, romc::robot_file::by_name("go1"));
    let robot = robot.expect("a known robot");
    let options = settings.options(4, "m".to_owned(), robot).expect("options");
    let (method, others) = (settings.method(), settings.conditioning());
    format!("{options:?} {others:?} {method:?} {}", settings.actuators())
}

#[test]
fn defaults_in_the_help_of_train_are_those_of_the_training() {
    // For these flags another option is stored, with the same effect.
    const SAME: [&str; 3] = ["body", "degree", "clock"];
    let command = Arguments::command();
    let train = command.find_subcommand("train").expect("a command");
    let mut checked = BTreeSet::new();
    for argument in train.get_arguments() {
        let help = argument.get_help().map(ToString::to_string);
        let (Some(flag), Some(help)) = (argument.get_long(), help) else {
            continue;
        };
        let defaults = help.split_once("[default: ").map(|(_, after)| after);
        let defaults = defaults.map_or("", |after| after.trim_end_matches(']'));
        for default in defaults.split("; ").filter(|_| !SAME.contains(&flag)) {
            let (value, others) = match default.strip_suffix(" with --paper") {
                Some(value) => (value, "--paper --method joint"),
                None => (default, "--method closed-form"),
            };
            let is_value = !value.contains(' ') && (value != "none" || flag == "actuators");
            if is_value && !value.is_empty() && flag != "method" {
                let given = training(&format!("{others} --{flag} {value}"));
                assert_eq!(given, training(others), "--{flag} {default}");
                checked.insert((flag, others));
            }
        }
    }
    assert!(checked.len() >= 38, "{checked:?}");
    assert_eq!(training(""), training("--method closed-form"));
    assert_eq!(training("--paper"), training("--paper --method joint"));
}
