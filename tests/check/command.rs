//! The command from outside: exit codes, text and JSON.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::command_line::{romc, text};

fn check(folder: &Path, arguments: &[&str]) -> Output {
    romc(folder, &[&["check"], arguments].concat())
}

#[test]
fn equal_files_exit_with_0_and_say_how_far_rounding_reaches() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(
        folder.path().join("a.txt"),
        "[contact]\nddz1 = 0.3612*sin(2*z1)\n",
    )
    .expect("written");
    let paper =
        r"\begin{equation}\label{eq:contact} \ddot z_1 = 0.72\sin z_1\cos z_1 \end{equation}";
    fs::write(folder.path().join("b.tex"), paper).expect("written");
    let output = check(folder.path(), &["a.txt", "b.tex"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(
        text(&output.stdout),
        "A: a.txt\nB: b.tex\n\nphase contact\n  ddz1: proven equal up to the printed digits \
         (coefficients differ by at most 6.000e-4)\n\nA and B are equal: 1 equation proven \
         equal, 1 of them up to the printed digits\n"
    );
    let output = check(folder.path(), &["a.txt", "b.tex", "--exact", "--json"]);
    assert_eq!(output.status.code(), Some(1), "decimals as written differ");
    let value: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(value["equal"], false);
    assert_eq!(value["phases"][0]["equations"][0]["verdict"], "different");
    let output = check(folder.path(), &["a.txt", "a.txt"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(text(&output.stdout).ends_with("A and B are equal: 1 equation proven equal\n"));
}

#[test]
fn tiny_and_huge_numbers_are_printed_without_rows_of_zeros() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, equation) in [("a.txt", "1e-320*z1 + 3e305*u1"), ("b.txt", "2e-320*z1")] {
        let contents = format!("ddz1 = {equation}\n");
        fs::write(folder.path().join(name), contents).expect("written");
    }
    let output = check(folder.path(), &["a.txt", "b.txt"]);
    assert_eq!(output.status.code(), Some(1));
    let found = text(&output.stdout);
    assert!(found.contains("z1: 1e-320 in A, 2e-320 in B"), "{found}");
    assert!(found.contains("u1: 3e305 in A"), "{found}");
    assert!(!found.contains("00000000"), "{found}");
}

#[test]
fn different_files_exit_with_1_and_a_point_inside_the_domain() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, contents: &str| {
        fs::write(folder.path().join(name), contents).expect("written")
    };
    write(
        "a.txt",
        "[contact]\nddz1 = 0.5*z1 + u1\n[flight]\nddz1 = -1 + log(z1)\n",
    );
    write(
        "b.txt",
        "[contact]\nddz1 = 0.5*z1 - u1\n[flight]\nddz1 = -1 + log(abs(z1))\n[rear]\nddz1 = 0\n",
    );
    write(
        "domain.toml",
        "[contact]\nz1 = [4.0, 5.0]\nu1 = [2.0, 2.5]\n",
    );
    let output = check(
        folder.path(),
        &["a.txt", "b.txt", "--domain", "domain.toml", "--json"],
    );
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let value: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let contact = &value["phases"][0]["equations"][0];
    let at = |name: &str| contact["point"]["at"][name].as_f64().expect("a value");
    assert!((4.0..=5.0).contains(&at("z1")) && (2.0..=2.5).contains(&at("u1")));
    let difference = contact["point"]["difference"].as_f64().expect("a number");
    assert!((difference - 2.0 * at("u1")).abs() < 1e-9);
    assert_eq!(contact["terms"][0]["term"], "u1");
    let flight = &value["phases"][1]["equations"][0];
    assert_eq!(flight["verdict"], "equal");
    assert!(flight["one_sided"]["a"].is_null() && flight["one_sided"]["b"].is_number());
    assert_eq!(value["phases"][2]["equations"][0]["missing_in"], "A");
}

#[test]
fn terms_that_rounding_drops_are_named_as_such() {
    let folder = tempfile::tempdir().expect("a folder");
    let exact = "[contact]\nddz1 = 0.36*z1 + 0.004*u1\n";
    fs::write(folder.path().join("a.txt"), exact).expect("written");
    let paper = r"\begin{equation}\label{eq:contact} \ddot z_1 = 0.36 z_1 \end{equation}";
    fs::write(folder.path().join("b.tex"), paper).expect("written");
    let output = check(folder.path(), &["a.txt", "b.tex"]);
    assert_eq!(output.status.code(), Some(1));
    let shown = text(&output.stdout);
    assert!(
        shown.contains("\n    u1: 0.004 in A, not in B\n"),
        "{shown}"
    );
    let note =
        "    note: B (b.tex) has rounded decimals, and terms that round to zero are not printed\n";
    assert!(shown.contains(note), "{shown}");
    assert!(shown.ends_with("0 of 1 equation proven equal\n"), "{shown}");
}

#[test]
fn unreadable_files_exit_with_2_and_name_the_place() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(
        folder.path().join("a.tex"),
        "\\[\\ddot z_1 = \\arcsin z_1\\]\n",
    )
    .expect("written");
    fs::write(folder.path().join("b.txt"), "ddz1 = z1").expect("written");
    fs::write(folder.path().join("c.npz"), "").expect("written");
    fs::write(folder.path().join("d.toml"), "[contact]\nx = [0, 1]\n").expect("written");
    for (arguments, message) in [
        (
            vec!["a.tex", "b.txt"],
            "error: a.tex:1:15: found `\\arcsin`, expected",
        ),
        (
            vec!["b.txt", "c.npz"],
            "error: c.npz: found the ending `.npz`, expected a model",
        ),
        (
            vec!["b.txt", "none.txt"],
            "error: none.txt: cannot read the file",
        ),
        (
            vec!["b.txt", "b.txt", "--domain", "d.toml"],
            "error: d.toml: [contact] `x`: expected z1",
        ),
        (
            vec!["a.tex", "b.txt", "--symbols", "y=x"],
            "error: `y=x`: expected `VARIABLE=NAME`",
        ),
    ] {
        let output = check(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let stderr = text(&output.stderr);
        assert!(stderr.starts_with(message), "{stderr}");
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn names_of_variables_that_a_paper_does_not_have_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("a.tex"), r"\[\ddot x = x + u_1\]").expect("writable");
    let symbols = ["--symbols", "z1=x", "--symbols", "u2=F"];
    for command in [
        &["check", "a.tex", "a.tex"][..],
        &["import", "a.tex", "--output", "m.json"],
    ] {
        let run = romc(folder.path(), &[command, &symbols].concat());
        assert_eq!(run.status.code(), Some(2));
        let said = text(&run.stderr);
        assert!(
            said.contains("--symbols: found u2=F, expected variables of the 1 latent"),
            "{said}"
        );
    }
}

#[test]
fn papers_become_models() {
    let folder = tempfile::tempdir().expect("a folder");
    let paper = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/papers/align.tex");
    let paper = paper.to_str().expect("a name");
    let arguments = ["import", paper, "--output", "paper.json"];
    let output = romc(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/paper-2d.json");
    let output = check(
        folder.path(),
        &["paper.json", shipped.to_str().expect("a name")],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout));
}

#[test]
fn numbers_beyond_floats_are_told_apart_and_equal_ones_proven() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let verdict = |a: &str, b: &str| {
        for (name, side) in [("a.txt", a), ("b.txt", b)] {
            fs::write(folder.join(name), format!("ddz1 = {side}\nddz2 = 0\n")).expect("written");
        }
        check(folder, &["a.txt", "b.txt"]).status.code()
    };
    for (a, b) in [
        ("(10*z1)^20 + z1^20", "(10*z1)^20"),
        ("7^25*z1 + z1", "7^25*z1"),
        (
            "123456789*987654321*100*z1 + z1",
            "123456789*987654321*100*z1",
        ),
        ("1e17*z1 + z1 - 1e17*z1", "0"),
        ("1.5^0.5*z1", "1.224744871391589*z1"),
        ("2.5^30", "867361737988.4036"),
        ("exp(1e16 + 1)*z1", "exp(1e16)*z1"),
        ("1/(z1 + 1e17)", "1/(z1 + 1e17 + 1)"),
    ] {
        assert_eq!(verdict(a, b), Some(1), "{a} and {b}");
    }
    for (a, b) in [
        ("2^100", "1267650600228229401496703205376"),
        ("z1/3^41", "z1/36472996377170786403"),
        ("abs(z1)", "exp(log(z1))"),
        ("abs(z1)", "sqrt(z1)^2"),
        ("0.5*z1^1.5 + 2.5^2", "z1*sqrt(z1)/2 + 25/4"),
    ] {
        assert_eq!(verdict(a, b), Some(0), "{a} and {b}");
    }
}

#[test]
fn fractions_of_a_text_are_equal_to_the_floats_of_its_model_and_zeros_are_imported() {
    let folder = tempfile::tempdir().expect("a folder");
    let romc = |arguments: &[&str]| {
        let output = romc(folder.path(), arguments);
        (output.status.code(), text(&output.stdout))
    };
    for (name, equations, said) in [
        (
            "thirds",
            "ddz1 = z1/3 - dz1/1.1\nddz2 = (2*z1 + 1)/3 + 0.1*u1 + 0.2*u1\n",
            "printed digits",
        ),
        ("zeros", "ddz1 = sin(-z1) + sin(z1)\n", "proven equal"),
    ] {
        let [typed, model] = ["txt", "json"].map(|ending| format!("{name}.{ending}"));
        fs::write(folder.path().join(&typed), equations).expect("written");
        let (code, _) = romc(&[
            "import",
            &typed,
            "--phase",
            "contact=any",
            "--output",
            &model,
        ]);
        assert_eq!(code, Some(0), "{name}");
        let (code, stdout) = romc(&["check", &typed, &model]);
        assert_eq!(code, Some(0), "{name}: {stdout}");
        assert!(stdout.contains(said), "{name}: {stdout}");
        fs::write(
            folder.path().join("wrong.txt"),
            equations
                .replace("/3", "/3.0000001")
                .replace("sin(z1)", "cos(z1)"),
        )
        .expect("written");
        let (code, stdout) = romc(&["check", "wrong.txt", &model]);
        assert_eq!(code, Some(1), "{name}: {stdout}");
        assert!(stdout.contains("different"), "{name}: {stdout}");
    }
}
