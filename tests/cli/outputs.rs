//! Outputs never overwrite an input of the command, and always have the format of their name.

use std::fs;
use std::path::Path;

use super::{JUMP, MODEL, done, folder, json, path, refused};

/// Copies of a model, a recording and other files, and commands that would overwrite one of them.
#[test]
fn no_command_replaces_a_file_that_it_reads() {
    let folder = folder();
    let at = |name: &str| path(&folder, name);
    let (model, jump, map, robot) = (
        at("model.json"),
        at("jump.csv"),
        at("map.toml"),
        at("go1.toml"),
    );
    let (start, page) = (at("start.csv"), at("page.html"));
    fs::copy(MODEL, &model).expect("copied");
    done(&["convert", JUMP, "--output", &jump]);
    done(&["convert", JUMP, "--output", &start]);
    done(&["robot", "go1", "--output", &robot]);
    fs::copy(&robot, &map).expect("copied");
    fs::copy(&jump, &page).expect("copied");
    let kept = |name: &str| fs::read(name).expect("kept");
    let jump_d = ["--distance", "0.3", "--apex", "0.1"];
    let cases: &[(&str, &[&str])] = &[
        (&jump, &["mpc", &model, &jump]),
        (&jump, &["simulate", &model, &jump]),
        (&jump, &["convert", &jump]),
        (
            &start,
            &[
                "plan", &model, jump_d[0], jump_d[1], jump_d[2], jump_d[3], "--start", &start,
            ],
        ),
        (&page, &["report", &model, &page]),
        (
            &map,
            &["identify", &jump, "--robot", "go1", "--columns", &map],
        ),
        (&robot, &["identify", &jump, "--robot", &robot]),
        (&robot, &["robot", &robot]),
        (&map, &["inspect", "--guess", &map]),
        (&model, &["import", &model]),
        (&model, &["train", &model, "--latent-dim", "4"]),
        (
            &model,
            &["train", &jump, "--validation", &model, "--latent-dim", "4"],
        ),
    ];
    for (read, command) in cases {
        let file = Path::new(read).file_name().expect("a name");
        let other = folder.path().join("sub/..").join(file);
        let link = folder.path().join("link").with_extension(
            file.to_string_lossy()
                .rsplit('.')
                .next()
                .expect("an ending"),
        );
        fs::create_dir_all(folder.path().join("sub")).expect("made");
        let _ = fs::remove_file(&link);
        std::os::unix::fs::symlink(read, &link).expect("linked");
        let before = kept(read);
        for spelling in [Path::new(read), &other, &link] {
            let output = spelling.to_str().expect("a path of characters");
            for force in [&["--force"][..], &[]] {
                let error = refused(&[*command, &["--output", output], force].concat());
                assert!(error.contains("the command reads this file"), "{error}");
                assert!(error.contains(output), "{error}");
            }
        }
        assert_eq!(kept(read), before);
    }
}

#[test]
fn no_command_replaces_an_input_by_a_file_of_a_folder() {
    let folder = folder();
    let out = path(&folder, "out");
    fs::create_dir(&out).expect("made");
    let model = path(&folder, "out/go1_d4.tex");
    fs::copy(MODEL, &model).expect("copied");
    let error = refused(&[
        "compile",
        &model,
        "--emit",
        "latex",
        "--out-dir",
        &out,
        "--force",
    ]);
    assert!(error.contains("the command reads this file"), "{error}");
    let saved = path(&folder, "out/model.json");
    fs::copy(MODEL, &saved).expect("copied");
    let tolerance = ["--tolerance", "1%", "--domain", JUMP, "--force"];
    let compile = ["compile", &saved, "--out-dir", &out, "--save-model", &saved];
    let error = refused(&[&compile[..], &tolerance].concat());
    assert!(error.contains("the command reads this file"), "{error}");
}

#[test]
fn outputs_have_the_format_that_their_name_says_or_are_refused() {
    let folder = folder();
    let at = |name: &str| path(&folder, name);
    for (command, name, expected) in [
        (&["simulate", MODEL, JUMP][..], "x.mcap", "ends in .csv"),
        (&["simulate", MODEL, JUMP], "x.csv.gz", "ends in .csv"),
        (&["mpc", MODEL, JUMP], "x.mcap", "ends in .csv"),
        (&["report", MODEL, JUMP], "x.pdf", "ends in .html or .htm"),
        (
            &["identify", JUMP, "--robot", "go1"],
            "x.json",
            "ends in .toml",
        ),
        (&["robot", "go1"], "x.urdf", "ends in .toml"),
        (&["inspect", "--guess", JUMP], "x.csv", "ends in .toml"),
        (
            &["train", JUMP, "--latent-dim", "4"],
            "x.toml",
            "ends in .json",
        ),
        (&["import", MODEL], "x.npz", "ends in .json"),
        (
            &["convert", JUMP],
            "x.parquet",
            "ends in .csv, .csv.gz or .mcap",
        ),
        (
            &["plan", MODEL, "--distance", "0.3", "--apex", "0.1"],
            "x.json",
            "ends in .csv, .csv.gz or .mcap",
        ),
    ] {
        let output = at(name);
        let error = refused(&[command, &["--output", &output]].concat());
        assert!(error.contains(expected), "{error}");
        assert!(!fs::exists(&output).expect("readable"), "{output}");
    }
}

#[test]
fn a_plan_as_mcap_is_the_plan_as_csv() {
    let folder = folder();
    let samples = |name: &str| {
        let plan = path(&folder, name);
        let goal = ["--distance", "0.3", "--apex", "0.1"];
        done(&[&["plan", MODEL], &goal[..], &["--output", &plan]].concat());
        let table = path(&folder, &format!("{name}.again.csv"));
        done(&["convert", &plan, "--output", &table]);
        let segment = json(&["inspect", &table])["files"][0]["segments"][0].clone();
        let phases = segment["phases"].as_array().expect("phases").iter();
        let samples = phases.map(|phase| phase["samples"].as_u64().expect("a count"));
        samples.collect::<Vec<_>>()
    };
    let [mcap, csv, gz] = ["p.mcap", "p.csv", "p.csv.gz"].map(samples);
    assert_eq!(csv.len(), 3, "contact, flight, contact");
    assert_eq!(csv, gz);
    assert_eq!(mcap, csv);
}

/// Two processes with one output, repeatedly: one of them writes the file, the other fails with an error.
#[test]
fn of_two_commands_with_one_output_one_succeeds_and_the_other_names_the_file() {
    let folder = folder();
    for run in 0..8 {
        let output = path(&folder, &format!("robot{run}.toml"));
        let started = ["go1", "go2"].map(|robot| {
            std::process::Command::new(env!("CARGO_BIN_EXE_romc"))
                .args(["robot", robot, "--output", &output])
                .stderr(std::process::Stdio::piped())
                .stdout(std::process::Stdio::null())
                .spawn()
                .expect("the binary runs")
        });
        let ended = started.map(|process| process.wait_with_output().expect("it ends"));
        let won = ended.each_ref().map(|ended| ended.status.success());
        assert_ne!(won[0], won[1], "run {run}: {won:?}");
        let written = fs::read_to_string(&output).expect("one of them");
        let name = if won[0] { "go1" } else { "go2" };
        assert!(
            written.contains(&format!("\"{name}\"")),
            "{name}: {written}"
        );
        let loser = &ended[usize::from(won[0])];
        let error = super::text(&loser.stderr);
        assert!(
            error.contains(&output) && error.contains("already exists"),
            "{error}"
        );
    }
    let left = fs::read_dir(folder.path()).expect("a folder");
    assert_eq!(left.count(), 8, "nothing is left beside them");
}

/// Flags and rows that would be dropped are refused or noted.
#[test]
fn what_a_command_does_not_do_is_refused_or_noted() {
    let folder = folder();
    let at = |name: &str| path(&folder, name);
    let (out, model, study) = (at("out"), at("model.json"), at("study"));
    let train = ["train", JUMP, "--latent-dim", "2", "--output", &model];
    for (arguments, reason) in [
        (
            &[
                "compile",
                "models/paper-2d.json",
                "--units",
                "physical",
                "--out-dir",
                &out,
            ][..],
            "need an encoder and a decoder",
        ),
        (
            &[
                "compile",
                "models/paper-2d.json",
                "--units",
                "scaled",
                "--out-dir",
                &out,
            ],
            "needs a model with an encoder",
        ),
        (
            &[
                "compile",
                MODEL,
                "--emit",
                "c",
                "--digits",
                "3",
                "--out-dir",
                &out,
            ],
            "--digits",
        ),
        (
            &[&train[..], &["--paper", "--refinements", "3"]].concat(),
            "refinements",
        ),
    ] {
        let error = refused(arguments);
        assert!(error.contains(reason), "{arguments:?}: {error}");
    }
    let usage = super::romc(&["study", JUMP, "--latent-dims", "2,2", "--out-dir", &study]);
    assert_eq!(usage.status.code(), Some(2));
    assert!(super::text(&usage.stderr).contains("found 2 twice"));
    for (arguments, reason) in [
        (
            &["simulate", MODEL, JUMP, "--restart-every", "5"][..],
            "no recording is longer",
        ),
        (&["simulate", MODEL, JUMP, JUMP], "counts twice"),
        (
            &["compile", MODEL, "--emit", "c,c", "--out-dir", &out],
            "`c` is named twice",
        ),
        (
            &[&train[..], &["--lift-weight", "1", "--force"]].concat(),
            "--lift-weight: without effect",
        ),
        (
            &[&train[..], &["--seed", "2", "--force"]].concat(),
            "same model from every start",
        ),
    ] {
        let output = super::romc(arguments);
        let notes = super::text(&output.stderr) + &super::text(&output.stdout);
        assert!(notes.contains(reason), "{arguments:?}: {notes}");
    }
    let arguments = [
        "study",
        JUMP,
        "--latent-dims",
        "2,10",
        "--seeds",
        "1",
        "--out-dir",
        &study,
    ];
    let answer = json(&arguments);
    assert_eq!(answer["refused"][0]["latent_dim"], 10, "{answer}");
    let said = done(&arguments);
    assert!(said.contains("no model: d = 10 seed 1: "), "{said}");
}
