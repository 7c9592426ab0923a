//! Planned walks.

use romc::plan::{Verdict, WalkGoal, walk};
use romc::recording::stride_s;
use romc::robot::{BODY_X, BODY_Z};

use super::*;

fn trot() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    root.join("models/go1-trot-d6.json").display().to_string()
}

#[test]
fn walk_has_the_speed_the_turn_and_the_feet_of_a_trot() {
    let model = romc::artifact::read(Path::new(&trot())).expect("shipped");
    for (speed_m_s, yaw_rate_rad_s) in [(0.5, 0.0), (0.7, 0.4), (0.3, -0.3)] {
        let goal = WalkGoal {
            speed_m_s,
            yaw_rate_rad_s,
            duration_s: 4.0,
        };
        let planned = walk(&model, &goal).expect("strides");
        assert_eq!(planned.verdict, Verdict::Trusted);
        let motion = &planned.motion;
        let last = motion.len() - 1;
        let turned = motion.x[(17, last)] - motion.x[(17, 0)];
        assert!((turned - 4.0 * yaw_rate_rad_s).abs() < 0.05, "{turned}");
        let mean = |row: usize| motion.dx.row(row).mean();
        let speed = (0..=last).map(|k| motion.dx[(BODY_X, k)].hypot(motion.dx[(BODY_X + 1, k)]));
        let speed = speed.sum::<f64>() / motion.len() as f64;
        assert!((speed / speed_m_s - 1.0).abs() < 0.05, "{speed}");
        assert!(mean(BODY_Z).abs() < 0.01);
        let found = stride_s(std::iter::once(motion)).expect("a walk");
        assert!((found / planned.stride_s - 1.0).abs() < 0.02, "{found}");
        // Diagonal pairs, each as long as the other.
        let pairs = motion
            .feet
            .iter()
            .filter(|[fr, fl, rr, rl]| fr == rl && fl == rr);
        assert!(pairs.count() as f64 > 0.8 * motion.len() as f64);
        let carried = |foot: usize| motion.feet.iter().filter(|feet| feet[foot]).count() as f64;
        assert!((carried(0) / carried(1) - 1.0).abs() < 0.1);
        // The model finds its own inputs in it: their sum carries the robot's weight.
        let rule = model.input_rule().expect("a robot");
        let input = motion.input(&rule).expect("inputs");
        let weight = input.row(BODY_Z).mean() / 9.81;
        assert!((11.0..14.5).contains(&weight), "{weight} kg");
    }
}

/// A reference that turns is not for a controller in the axes of the world.
#[test]
fn commands_note_a_walk_that_turns() {
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, model) = (folder.path(), trot());
    let noted = |yaw_rate: &str| {
        let goal = [
            "--speed",
            "0.4",
            "--yaw-rate",
            yaw_rate,
            "--duration",
            "1",
            "--force",
        ];
        done(
            folder,
            &[&["plan", &model, "--output", "plan.csv"], &goal[..]].concat(),
        );
        let emit = [
            "--emit",
            "controller-c",
            "--plan",
            "plan.csv",
            "--out-dir",
            "out",
            "--force",
        ];
        let compiled = romc(folder, &[&["compile", &model], &emit[..]].concat());
        let simulated = romc(folder, &["simulate", &model, "plan.csv"]);
        [compiled, simulated].map(|output| {
            text(&output.stderr).contains("1 of 1 motions turn by more than 0.25 rad")
        })
    };
    assert_eq!(noted("0.5"), [true; 2]);
    assert_eq!(noted("0.1"), [false; 2]);
}

#[test]
fn walk_is_written_with_the_settings_of_its_controller_or_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, model) = (folder.path(), trot());
    let plan = ["plan", &model, "--output", "plan.csv", "--json"];
    let goal = ["--speed", "0.4", "--yaw-rate", "0.2", "--duration", "2"];
    let said: Value = serde_json::from_str(&done(folder, &[&plan[..], &goal].concat())).expect("J");
    assert_eq!(said["status"], "trusted", "{said}");
    let settings = fs::read_to_string(folder.join("plan.settings.toml")).expect("written");
    assert!(settings.contains("legs = 1.0"), "{settings}");
    let inspected = done(folder, &["inspect", "plan.csv", "--json"]);
    let inspected: Value = serde_json::from_str(&inspected).expect("JSON");
    let stride = number(&inspected["files"][0]["stride_s"]);
    assert!(
        (stride / number(&said["stride_s"]) - 1.0).abs() < 0.02,
        "{inspected}"
    );
    // Diagonal feet are down together, the others when they are not.
    let strips = done(folder, &["inspect", "plan.csv"]);
    let strip = |foot: &str| {
        let line = strips
            .lines()
            .find(|line| line.starts_with(&format!("  {foot} |")));
        line.expect("a strip")
            .split('|')
            .nth(1)
            .expect("between bars")
            .to_owned()
    };
    let [fr, fl, rr, rl] = ["fr", "fl", "rr", "rl"].map(strip);
    let alike = |a: &str, b: &str| a.chars().zip(b.chars()).filter(|(a, b)| a == b).count();
    assert!(alike(&fr, &rl) > 50 && alike(&fl, &rr) > 50, "{strips}");
    assert!(alike(&fr, &fl) < 15, "{strips}");
    fs::remove_file(folder.join("plan.csv")).expect("there");
    let fast = failed(folder, &[&plan[..], &["--speed", "2"]].concat());
    assert!(fast.contains("speed 2 m/s, recorded from"), "{fast}");
    let jumper = super::model();
    let jumps = failed(
        folder,
        &["plan", &jumper, "--output", "plan.csv", "--speed", "0.4"],
    );
    assert!(jumps.contains("strides"), "{jumps}");
    // A model file may have any time between samples.
    let text = fs::read_to_string(&model).expect("shipped");
    let text = text.replace("\"sample_time_s\": 0.002", "\"sample_time_s\": 1e-6");
    fs::write(folder.join("fine.json"), &text).expect("written");
    let fine = [
        "plan",
        "fine.json",
        "--output",
        "plan.csv",
        "--speed",
        "0.4",
    ];
    let fine = failed(folder, &fine);
    assert!(
        fine.contains("samples of the walk: found 5000000"),
        "{fine}"
    );
}

/// A planned walk begins in motion: no stand leads to its first posture.
#[test]
fn example_in_c_follows_a_planned_walk_from_its_first_sample() {
    let (model, scratch) = (trot(), tempfile::tempdir().expect("a folder"));
    let folder = scratch.path();
    let plan = ["--speed", "0.5", "--duration", "2", "--output", "plan.csv"];
    done(folder, &[&["plan", &model], &plan[..]].concat());
    let emit = ["--emit", "controller-c", "--plan", "plan.csv"];
    done(
        folder,
        &[&["compile", &model], &emit[..], &["--out-dir", "code"]].concat(),
    );
    let code = folder.join("code/go1_trot_d6-controller-c");
    let parameters = fs::read_to_string(code.join("ros2_control/controllers.yaml"));
    assert!(parameters.expect("emitted").contains("start: jump"));
    let built = std::process::Command::new("cc")
        .args(["-Wall", "-Wextra", "-Werror", "-O1", "-ffp-contract=off"])
        .args(["go1_trot_d6_example.c", "go1_trot_d6_controller.c"])
        .args(["go1_trot_d6.c", "-lm", "-o", "example"])
        .current_dir(&code)
        .status();
    assert!(built.expect("a C compiler").success());
    let ran = std::process::Command::new(code.join("example")).output();
    let ran = ran.expect("built");
    let printed = text(&ran.stdout);
    assert!(ran.status.success(), "{printed}{}", text(&ran.stderr));
    assert!(printed.matches("solved").count() > 30, "{printed}");
    assert!(!printed.contains("stand up"), "{printed}");
}

#[test]
fn torques_of_planned_walks_grow_with_speed_and_turning_and_the_ends_extrapolate() {
    let model = romc::artifact::read(Path::new(&trot())).expect("shipped");
    let map = romc::plan::walk_reach(&model).expect("strides");
    let (columns, rows) = (map.speeds_m_s.len(), map.yaw_rates_rad_s.len());
    assert_eq!(map.points.len(), columns * rows);
    let at = |row: usize, column: usize| &map.points[row * columns + column];
    let middle = rows / 2;
    assert_eq!(at(middle, columns / 2).status, "trusted");
    for corner in [at(0, 0), at(0, columns - 1), at(rows - 1, columns - 1)] {
        assert_eq!(corner.status, "extrapolates");
    }
    for column in 1..columns {
        let [slower, faster] = [column - 1, column].map(|k| at(middle, k).torque_share);
        assert!(slower < faster && faster < 1.0, "{slower} {faster}");
        assert!(at(middle, column).torque_share < at(0, column).torque_share);
    }
}

/// A walk that repeats the mean stride is predicted by it, and not by a constant velocity.
#[test]
fn mean_stride_predicts_a_planned_walk() {
    use romc::evaluate::{Assessment, Horizon};
    use romc::recording::Recording;

    let model = romc::artifact::read(Path::new(&trot())).expect("shipped");
    let goal = WalkGoal {
        speed_m_s: 0.5,
        yaw_rate_rad_s: 0.0,
        duration_s: 3.0,
    };
    let recordings = [Recording {
        path: "walk.csv".into(),
        segments: vec![walk(&model, &goal).expect("strides").motion],
        ignored_columns: Vec::new(),
    }];
    let assessment = Assessment::over(&model, &recordings, 0.1).expect("encodes");
    let horizons = Horizon::all(&model, &assessment).expect("a walk");
    let stride = horizons
        .iter()
        .find(|horizon| horizon.name.starts_with("stride"));
    let rms = |of: &str| {
        let predictors = &stride.expect("a stride").predictors;
        let (_, sums) = predictors
            .iter()
            .find(|(name, _)| *name == of)
            .expect("of walks");
        let [x, z] =
            ["body.x", "body.z"].map(|name| assessment.fit(sums, name).expect("varies").rms);
        x.hypot(z)
    };
    let [mean, constant] = ["mean stride", "constant velocity"].map(rms);
    assert!(mean < 5e-4 && mean < 0.1 * constant, "{mean} {constant}");
}
