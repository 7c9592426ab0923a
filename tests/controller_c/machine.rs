//! The state machine: its modes along a recorded jump that happens elsewhere in the world, under requests and faults, in
//! Rust, and the same to the bit in C.

use std::fs;

use romc::mpc::{Command, Machine, Measurement, Mode, MpcSettings, ReferenceSamples, Status};
use romc::recording::Segment;
use romc::robot::ContactFlags;

use crate::emitted::Emitted;
use crate::programs::{root, shipped, succeed};
use crate::random::Random;
use crate::tools::thorough_or;
use crate::{push, push_counts};

const STEP_S: f64 = 0.01;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Request {
    None,
    Stand,
    Jump,
    Damp,
    Reset,
    Prepare,
    New,
}

/// A robot whose joints go where they are sent and whose body moves as recorded, from where it stands in its own world.
struct Robot {
    machine: Machine,
    segment: Segment,
    input: Vec<f64>,
    time_s: f64,
    x: [f64; 18],
    dx: [f64; 18],
    feet: ContactFlags,
    /// Where it stands and looks: x, y, yaw.
    place: [f64; 3],
    jump_s: Option<f64>,
    command: Command,
    bytes: Vec<u8>,
}

impl Robot {
    fn new(bytes: Vec<u8>) -> Self {
        let path = root().join("examples/recordings/go1/test_01.csv.gz");
        let recording = romc::recording::read(&path).expect("a sound recording");
        let segment = recording.segments.into_iter().next().expect("a jump");
        let model = shipped("go1-d4");
        let settings = MpcSettings {
            solver: romc::mpc::Solver::Riccati,
            ..MpcSettings::default()
        };
        let controller = romc::mpc::controller(&model, settings).expect("a complete model");
        let rule = controller.plant().input_rule();
        let input = segment.input(rule).expect("inputs").as_slice().to_vec();
        let mut robot = Self {
            command: Command::zeros(4),
            machine: Machine::new(controller, romc::mpc::Timing::default()).expect("sound"),
            x: [0.0; 18],
            dx: [0.0; 18],
            feet: [true; 4],
            place: [3.0, -2.0, 1.0],
            jump_s: None,
            time_s: 5.0,
            input,
            segment,
            bytes,
        };
        robot.follow();
        let start = robot.recorded(0).0;
        robot.x = start;
        for joint in 0..12 {
            robot.x[joint] += 0.2 * [1.0, -1.0][joint % 2];
        }
        robot
    }

    fn follow(&mut self) {
        let samples = ReferenceSamples {
            time_s: &self.segment.time_s,
            x: self.segment.x.as_slice(),
            dx: self.segment.dx.as_slice(),
            u: Some(&self.input),
            feet: &self.segment.feet,
        };
        if self.bytes.is_empty() {
            push_counts(&mut self.bytes, &[samples.time_s.len() as i64]);
            for values in [samples.time_s, samples.x, samples.dx, &self.input] {
                push(&mut self.bytes, values);
            }
            let feet = samples.feet.iter().flatten().map(|down| u8::from(*down));
            self.bytes.extend(feet);
        }
        let controller = self.machine.controller_mut();
        controller.set_reference(samples).expect("sound");
    }

    /// A recorded sample at the robot's place; at rest after the last.
    fn recorded(&self, sample: usize) -> ([f64; 18], [f64; 18], ContactFlags) {
        let last = self.segment.len() - 1;
        let row = |of: &nalgebra::DMatrix<f64>| std::array::from_fn(|i| of[(i, sample.min(last))]);
        let (mut x, mut dx): ([f64; 18], [f64; 18]) = (row(&self.segment.x), row(&self.segment.dx));
        let first: [f64; 18] = std::array::from_fn(|i| self.segment.x[(i, 0)]);
        let (sine, cosine) = (self.place[2] - first[17]).sin_cos();
        let turned = |a: f64, b: f64| [cosine * a - sine * b, sine * a + cosine * b];
        let [along, aside] = turned(x[12] - first[12], x[13] - first[13]);
        (x[12], x[13]) = (self.place[0] + along, self.place[1] + aside);
        x[17] += self.place[2] - first[17];
        [dx[12], dx[13]] = turned(dx[12], dx[13]);
        if sample > last {
            dx = [0.0; 18];
        }
        (x, dx, self.segment.feet[sample.min(last)])
    }

    /// A step with a request before it and a change of the measurement; the answer to the request.
    fn step(&mut self, request: Request, change: impl Fn(&mut f64, &mut [f64; 18])) -> bool {
        self.time_s += STEP_S;
        let mode = self.machine.mode();
        if let (Mode::Jump | Mode::Land, Some(start_s)) = (mode, self.jump_s) {
            let spacing_s = self.segment.mean_step_s();
            let sample = ((self.time_s - start_s) / spacing_s).round() as usize;
            (self.x, self.dx, self.feet) = self.recorded(sample);
        } else {
            (self.dx, self.feet) = ([0.0; 18], [mode != Mode::Damp; 4]);
            if matches!(mode, Mode::StandUp | Mode::Ready | Mode::Recover) {
                let sent = &self.command.joint_position_rad;
                let moved: [f64; 12] = std::array::from_fn(|joint| sent[joint] - self.x[joint]);
                self.x[..12].copy_from_slice(sent);
                self.dx[..12].copy_from_slice(&moved.map(|angle| angle / STEP_S));
            }
        }
        let (mut time_s, mut x) = (self.time_s, self.x);
        change(&mut time_s, &mut x);
        let answer = match request {
            Request::Stand => self.machine.stand(time_s, &x),
            Request::Jump => self.machine.jump(),
            Request::Damp => {
                self.machine.damp();
                false
            }
            Request::Reset => {
                self.machine.reset();
                false
            }
            Request::Prepare => {
                self.machine.prepare(time_s);
                false
            }
            Request::None | Request::New => false,
        };
        let measurement = Measurement {
            time_s,
            x: &x,
            dx: &self.dx,
            feet: self.feet,
        };
        self.machine.step_into(measurement, &mut self.command);
        if self.machine.mode() == Mode::Jump && mode == Mode::Ready {
            self.jump_s = Some(self.time_s);
            self.place = [self.x[12], self.x[13], self.x[17]];
        }
        let mode = self.machine.mode();
        let asked = [request as i64, i64::from(answer)];
        push_step(&mut self.bytes, asked, measurement, &self.command, mode);
        answer
    }

    fn still(&mut self, request: Request) -> bool {
        self.step(request, |_, _| ())
    }

    /// Steps until a mode; how many.
    fn until(&mut self, mode: Mode) -> usize {
        for steps in 0..400 {
            if self.machine.mode() == mode {
                return steps;
            }
            self.still(Request::Prepare);
            let found = self.machine.mode();
            assert!(
                found != Mode::Damp,
                "{:?} on the way to {mode:?}",
                self.command.status
            );
        }
        panic!("{:?}, not {mode:?}", self.machine.mode());
    }
}

/// A step as `machine.c` reads it: the request with its answer, the measurement, the command and the mode after it.
pub fn push_step(
    bytes: &mut Vec<u8>,
    asked: [i64; 2],
    measurement: Measurement<'_>,
    command: &Command,
    mode: Mode,
) {
    push_counts(bytes, &asked);
    push(bytes, &[measurement.time_s]);
    push(bytes, measurement.x);
    push(bytes, measurement.dx);
    let down = |foot: usize| i64::from(measurement.feet[foot]) << foot;
    push_counts(bytes, &[(0..4).map(down).sum()]);
    push(bytes, &command.torque_nm);
    push(bytes, &command.joint_position_rad);
    push(bytes, &command.joint_velocity_rad_s);
    let drives = command.drives;
    push(bytes, &[drives.stiffness_nm_rad, drives.damping_nm_s_rad]);
    push(bytes, &command.u_lat);
    push_counts(bytes, &[i64::from(command.status.code()), mode as i64]);
}

#[test]
fn robot_stands_up_jumps_where_it_stands_lands_and_stands_again() {
    let mut robot = Robot::new(Vec::new());
    robot.still(Request::None);
    assert_eq!(robot.command.status, Status::Damped);
    assert!(robot.still(Request::Stand));
    assert!(!robot.still(Request::Jump), "jumps while it stands up");
    assert_eq!(robot.until(Mode::Ready), 181);
    let off = |robot: &Robot| {
        let first = robot.recorded(0).0;
        (0..12)
            .map(|joint| (robot.command.joint_position_rad[joint] - first[joint]).abs())
            .fold(0.0, f64::max)
    };
    assert!(off(&robot) < 1e-12, "{}", off(&robot));
    // Knees hold the weight: four feet that press down by a quarter each.
    let knees: f64 = (0..4).map(|leg| robot.command.torque_nm[3 * leg + 2]).sum();
    assert!((8.0..40.0).contains(&knees), "{knees} N m");
    assert!(
        robot.still(Request::Stand),
        "moves to the start of another reference"
    );
    assert_eq!(robot.machine.mode(), Mode::Recover);
    robot.until(Mode::Ready);
    for _ in 0..2 {
        assert!(robot.still(Request::Jump));
        assert_eq!(robot.machine.mode(), Mode::Jump);
        assert!(
            robot.command.status.has_plan(),
            "{:?}",
            robot.command.status
        );
        robot.until(Mode::Land);
        robot.until(Mode::Recover);
        robot.until(Mode::Ready);
        assert!(off(&robot) < 1e-12, "{}", off(&robot));
    }
    robot.still(Request::Damp);
    assert_eq!(robot.machine.mode(), Mode::Damp);
    let start = robot.recorded(0).0;
    robot.x[..12].copy_from_slice(&start[..12]);
    assert!(robot.still(Request::Jump), "stands at the start");
    assert_eq!(robot.machine.mode(), Mode::Jump);
    robot.still(Request::Damp);
    for _ in 0..20 {
        robot.still(Request::None);
    }
    assert_eq!(robot.command.drives.stiffness_nm_rad, 0.0);
    assert!(robot.command.torque_nm.iter().all(|torque| *torque == 0.0));
}

/// Faults of a measurement, with the statuses that may follow in any mode but that of damped joints.
#[expect(clippy::type_complexity, reason = "a table")]
const FAULTS: &[(&str, fn(&mut f64, &mut [f64; 18]), &[Status])] = &[
    ("on its back", |_, x| x[15] = 3.1, &[Status::Tilt]),
    (
        "signs",
        |_, x| (0..12).for_each(|i| x[i] = -x[i]),
        &[Status::JointBeyond],
    ),
    (
        "leg in the air",
        |_, x| x[2] += 0.9,
        &[Status::JointBeyond, Status::JointsFar, Status::JointsLeap],
    ),
    (
        "clock",
        |time_s, _| *time_s -= 0.3,
        &[Status::ClockBack, Status::ClockStands],
    ),
    ("undefined", |_, x| x[4] = f64::NAN, &[Status::PoorSteps]),
    (
        "body leaps",
        |_, x| x[13] += 5.0,
        &[Status::BodyLeap, Status::BodyFar],
    ),
    (
        "knees bend",
        |_, x| x[14] += 0.12,
        &[
            Status::VelocityMismatch,
            Status::ContactMismatch,
            Status::BodyLeap,
        ],
    ),
];

#[test]
fn fault_in_any_mode_damps_until_a_reset() {
    for &(name, change, expected) in FAULTS {
        for mode in [
            Mode::StandUp,
            Mode::Ready,
            Mode::Jump,
            Mode::Land,
            Mode::Recover,
        ] {
            let mut robot = Robot::new(Vec::new());
            robot.still(Request::Stand);
            if mode != Mode::StandUp {
                robot.until(Mode::Ready);
                if mode != Mode::Ready {
                    robot.still(Request::Jump);
                    robot.until(mode);
                }
            }
            for _ in 0..15 {
                robot.still(Request::None);
            }
            let mut passed = 0;
            while robot.machine.mode() != Mode::Damp {
                assert!(
                    passed < 12,
                    "{name} in {mode:?}: {:?}",
                    robot.command.status
                );
                robot.step(Request::None, change);
                passed += 1;
            }
            let status = robot.command.status;
            assert!(expected.contains(&status), "{name} in {mode:?}: {status:?}");
            assert!(
                !robot.still(Request::Stand),
                "{name}: stands up after a fault"
            );
            robot.still(Request::Damp);
            assert_eq!(robot.command.status, status, "{name} in {mode:?}");
            robot.still(Request::Reset);
            assert_eq!(robot.command.status, Status::Damped);
            assert!(robot.still(Request::Stand));
            robot.until(Mode::Ready);
        }
    }
}

#[test]
fn state_machine_in_c_repeats_the_library_bit_for_bit() {
    let mut random = Random::new(7);
    let mut bytes = Vec::new();
    let mut counts = [0; 6];
    for run in 0..thorough_or(30, 12) {
        let mut robot = Robot::new(bytes);
        robot.still(Request::New);
        for step in 0..900 {
            let draw = 0.5 + 0.5 * random.signed();
            let mode = robot.machine.mode();
            counts[mode as usize] += 1;
            let has_fault = robot.command.status.code() >= Status::Tilt.code();
            let request = match (mode, draw) {
                (_, draw) if draw < 0.0005 => Request::Damp,
                (_, draw) if draw < 0.001 => Request::Reset,
                (_, draw) if draw < 0.003 => Request::Stand,
                (_, draw) if draw < 0.5 => Request::Prepare,
                (Mode::Damp, draw) if draw < 0.6 && has_fault => Request::Reset,
                (Mode::Damp, draw) if draw < 0.7 => Request::Stand,
                (Mode::Damp, draw) if draw < 0.75 => Request::Jump,
                (Mode::Ready, draw) if draw < 0.6 => Request::Jump,
                _ => Request::None,
            };
            let (_, change, _) = FAULTS[run % FAULTS.len()];
            let (noise, is_wrong) = (
                0.01 * random.signed(),
                (0..15).contains(&(step as i64 - 350 - 17 * run as i64)),
            );
            robot.step(request, |time_s, x| {
                x[step % 18] += noise;
                if is_wrong {
                    change(time_s, x);
                }
            });
        }
        bytes = robot.bytes;
    }
    assert!(counts.iter().all(|count| *count > 100), "{counts:?}");
    let emitted = Emitted::with_library_sines(&shipped("go1-d4"));
    let replay = root().join("tests/controller_c/machine.c");
    let program = emitted.program("cc", &["-Wfloat-equal"], replay.to_str().expect("UTF-8"));
    let file = emitted.scratch.path().join("steps");
    fs::write(&file, bytes).expect("written");
    let output = succeed(std::process::Command::new(program).arg(&file));
    println!("{}", String::from_utf8_lossy(&output.stdout));
}
