//! The state machine in a walk: stand up, start, change the velocity, turn, stop, stand, in Rust; and its commands
//! compared with those of the C, up to rounding.

use std::f64::consts::PI;
use std::fs;

use romc::mpc::{
    Command, Gait, Machine, Measurement, Mode, MpcSettings, Solver, Status, walk_settings,
    walk_strides,
};

use romc::robot::Leg;

use crate::emitted::Emitted;
use crate::machine::push_step;
use crate::programs::{root, shipped, succeed};
use crate::push_counts;

const STEP_S: f64 = 0.002;
/// The velocities of `machine.c`: forwards and to the left, m/s, and yaw, rad/s.
const VELOCITIES: [[f64; 3]; 4] = [
    [0.5, 0.0, 0.3],
    [0.8, 0.05, -0.4],
    [9.0, -9.0, 9.0],
    [0.5, f64::NAN, 0.0],
];
const TOLERANCE: f64 = 1e-6;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Request {
    None = 0,
    Stand = 1,
    Jump = 2,
    Damp = 3,
    Reset = 4,
    Prepare = 5,
    New = 7,
    Stop = 8,
    Walk = 9,
    Turn = 10,
    Beyond = 11,
    Undefined = 12,
    SetAgain = 13,
}

/// A robot whose joints follow their commands exactly and whose body moves as commanded, at some place in the world.
struct Robot {
    machine: Machine,
    time_s: f64,
    x: [f64; 18],
    dx: [f64; 18],
    /// Target velocity of the body, and its present one.
    velocity: [f64; 3],
    now: [f64; 3],
    gait: Gait,
    robot: &'static romc::robot::Robot,
    command: Command,
    bytes: Vec<u8>,
}

impl Robot {
    fn new() -> Self {
        let model = shipped("go1-trot-d6");
        let settings = MpcSettings {
            solver: Solver::Riccati,
            ..walk_settings(model.robot().expect("a robot"))
        };
        let controller = romc::mpc::controller(&model, settings).expect("a complete model");
        let timing = romc::mpc::Timing::default();
        let mut machine = Machine::new(controller, timing).expect("sound");
        let strides = walk_strides(&model).expect("it has strides");
        let mut x = [0.0; 18];
        let gait = strides.gait;
        x[..12].copy_from_slice(&gait.stand[..12]);
        (x[1], x[4]) = (x[1] + 0.2, x[4] - 0.2);
        [x[12], x[13], x[14], x[17]] = [3.0, -2.0, 0.27, 3.1];
        assert!(!machine.walk(VELOCITIES[0]), "without strides");
        machine.set_walk(strides).expect("strides to walk by");
        let mut bytes = Vec::new();
        push_counts(&mut bytes, &[0]);
        let mut robot = Self {
            machine,
            time_s: 7.0,
            x,
            dx: [0.0; 18],
            velocity: [0.0; 3],
            now: [0.0; 3],
            gait,
            robot: model.robot().expect("a robot"),
            command: Command::zeros(6),
            bytes,
        };
        robot.step(Request::New);
        robot
    }

    /// A step after a request; returns the answer to the request.
    fn step(&mut self, request: Request) -> bool {
        self.step_with(request, |_| ())
    }

    fn step_with(&mut self, request: Request, change: impl Fn(&mut [f64; 18])) -> bool {
        self.time_s += STEP_S;
        let mode = self.machine.mode();
        if !matches!(mode, Mode::Damp) {
            let sent = &self.command.joint_position_rad;
            let moved: [f64; 12] = std::array::from_fn(|joint| sent[joint] - self.x[joint]);
            self.x[..12].copy_from_slice(sent);
            self.dx[..12].copy_from_slice(&moved.map(|angle| angle / STEP_S));
        }
        self.dx[12..].fill(0.0);
        if mode == Mode::Walk {
            for i in 0..3 {
                let most = (self.gait.most[i] - self.gait.least[i]) * STEP_S / 2.0;
                self.now[i] += (self.velocity[i] - self.now[i]).clamp(-most, most);
            }
            let ([forward, left, turn], (sine, cosine)) = (self.now, self.x[17].sin_cos());
            self.dx[12] = cosine * forward - sine * left;
            self.dx[13] = sine * forward + cosine * left;
            self.dx[17] = turn;
        }
        let feet = match mode {
            Mode::Damp => [false; 4],
            _ => self.low_feet(),
        };
        for i in 12..18 {
            self.x[i] += STEP_S * self.dx[i];
        }
        // The heading is measured within half a turn.
        self.x[17] = (self.x[17] + PI).rem_euclid(2.0 * PI) - PI;
        let mut x = self.x;
        change(&mut x);
        let walk = |machine: &mut Machine| machine.walk(VELOCITIES[request as usize - 9]);
        let machine = &mut self.machine;
        let answer = match request {
            Request::None | Request::New => false,
            Request::Stand => machine.stand(self.time_s, &x),
            Request::Jump => machine.jump(),
            Request::Damp => {
                machine.damp();
                false
            }
            Request::Reset => {
                machine.reset();
                false
            }
            Request::Prepare => {
                machine.prepare(self.time_s);
                false
            }
            Request::Stop => machine.stop(),
            Request::SetAgain => {
                let strides = walk_strides(&shipped("go1-trot-d6")).expect("strides");
                machine.set_walk(strides).is_ok()
            }
            _ => walk(machine),
        };
        let measurement = Measurement {
            time_s: self.time_s,
            x: &x,
            dx: &self.dx,
            feet,
        };
        machine.step_into(measurement, &mut self.command);
        if machine.mode() == Mode::Walk && mode != Mode::Walk {
            self.now = [0.0; 3];
        }
        let asked = [request as i64, i64::from(answer)];
        let mode = machine.mode();
        push_step(&mut self.bytes, asked, measurement, &self.command, mode);
        answer
    }

    /// Feet near the floor: the supervisor compares the contact flags with their heights.
    fn low_feet(&self) -> [bool; 4] {
        let heights = Leg::ALL.map(|leg| {
            let q: [f64; 3] = std::array::from_fn(|joint| self.x[3 * leg.index() + joint]);
            self.robot.geometry(leg).foot_position(&q).z
        });
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        heights.map(|height| height < lowest + 0.015)
    }

    /// Steps for a time, with feedback about a body that reaches a velocity as late as a command arrives.
    fn pass(&mut self, seconds: f64, velocity: [f64; 3]) {
        for step in 0..(seconds / STEP_S) as usize {
            if step as f64 * STEP_S > 0.3 {
                self.velocity = velocity;
            }
            self.step([Request::None, Request::Prepare][step % 2]);
        }
    }

    fn until(&mut self, mode: Mode) {
        for _ in 0..3000 {
            if self.machine.mode() == mode {
                return;
            }
            self.step(Request::None);
        }
        panic!(
            "{:?}, not {mode:?}: {:?}",
            self.machine.mode(),
            self.command.status
        );
    }

    fn ready() -> Self {
        let mut robot = Self::new();
        assert!(!robot.step(Request::Jump), "strides are no jump");
        assert!(robot.step(Request::Stand));
        assert!(!robot.step(Request::Walk), "walks while it stands up");
        robot.until(Mode::Ready);
        robot
    }
}

#[test]
fn robot_walks_where_it_is_told_turns_more_than_a_turn_stops_and_stands() {
    let mut robot = Robot::ready();
    let stand: Vec<f64> = robot.command.joint_position_rad.to_vec();
    assert!(!robot.step(Request::Stop), "it does not walk");
    assert!(!robot.step(Request::Undefined));
    assert!(robot.step(Request::Walk));
    assert_eq!(robot.machine.mode(), Mode::Walk);
    robot.pass(0.1, [0.0; 3]);
    let off = |robot: &Robot| {
        let pairs = robot.command.joint_position_rad.iter().zip(&stand);
        pairs
            .map(|(sent, stood)| (sent - stood).abs())
            .fold(0.0, f64::max)
    };
    assert!(off(&robot) < 0.02, "steps at once: {}", off(&robot));
    robot.pass(25.0, VELOCITIES[0]);
    assert!(
        robot.command.status.has_plan(),
        "{:?}",
        robot.command.status
    );
    assert!(
        !robot.step(Request::Undefined),
        "no numbers, the walk goes on"
    );
    assert!(!robot.step(Request::Jump));
    assert!(!robot.step(Request::Stand));
    assert_eq!(robot.machine.mode(), Mode::Walk);
    let swing = |robot: &mut Robot| {
        let mut spread = 0.0f64;
        for _ in 0..180 {
            robot.step(Request::None);
            spread = spread.max(off(robot));
        }
        spread
    };
    let strides = swing(&mut robot);
    assert!(strides > 0.3, "{strides}");
    assert!(robot.step(Request::Stop));
    robot.pass(0.4, [0.0; 3]);
    robot.until(Mode::Recover);
    assert!(off(&robot) < 0.02, "{}", off(&robot));
    robot.until(Mode::Ready);
    assert!(robot.step(Request::Walk), "and again");
    assert_eq!(robot.machine.mode(), Mode::Walk);
}

#[test]
fn commands_are_kept_within_what_the_strides_reach_and_change_slowly() {
    let mut robot = Robot::ready();
    robot.step(Request::Beyond);
    let (least, most) = (robot.gait.least, robot.gait.most);
    assert!(most[0] > 0.9 && most[0] < 1.1, "{most:?}");
    // A body with the greatest speed of the strides stays near the reference; one with the requested speed does not.
    robot.pass(6.0, [most[0], least[1], most[2]]);
    assert_eq!(
        robot.machine.mode(),
        Mode::Walk,
        "{:?}",
        robot.command.status
    );
    assert!(robot.command.status.has_plan());
    robot.pass(3.0, [2.0 * most[0], least[1], most[2]]);
    assert_eq!(robot.machine.mode(), Mode::Damp);
    assert!(matches!(
        robot.command.status,
        Status::BodyFar | Status::BodyLeap | Status::VelocityMismatch
    ));
    assert!(!robot.step(Request::Walk), "after a fault");
    robot.step(Request::Reset);
    assert!(robot.step(Request::Stand));
    robot.until(Mode::Ready);
}

/// Requests before the next measurement, and references that replace the strides.
#[test]
fn requests_begin_only_what_was_asked_for() {
    let mut robot = Robot::ready();
    assert!(robot.machine.walk(VELOCITIES[0]));
    assert!(robot.machine.stop(), "it has not begun");
    robot.step(Request::None);
    assert_eq!(robot.machine.mode(), Mode::Ready);
    assert!(robot.machine.walk(VELOCITIES[0]));
    assert!(!robot.machine.jump());
    robot.step(Request::None);
    assert_eq!(robot.machine.mode(), Mode::Ready, "the last request counts");
    assert!(robot.machine.walk(VELOCITIES[0]));
    assert!(!robot.machine.stand(f64::NAN, &robot.x));
    robot.step(Request::None);
    robot.pass(1.0, VELOCITIES[0]);
    let off = robot.command.joint_position_rad[1] - robot.gait.stand[1];
    assert!(off.abs() > 1e-3, "the command was lost");

    let still = |robot: &mut Robot| {
        let (x, time_s) = ([robot.x; 3].concat(), [0.0, 0.1, 0.2]);
        let samples = romc::mpc::ReferenceSamples {
            time_s: &time_s,
            x: &x,
            dx: &[0.0; 54],
            u: None,
            feet: &[[true; 4]; 3],
        };
        let controller = robot.machine.controller_mut();
        controller.set_reference(samples).expect("sound");
    };
    still(&mut robot);
    for _ in 0..30 {
        robot.step(Request::None);
    }
    assert_eq!(
        robot.machine.mode(),
        Mode::Damp,
        "another reference ends the walk"
    );
    let mut robot = Robot::ready();
    assert!(robot.machine.walk(VELOCITIES[0]));
    still(&mut robot);
    robot.step(Request::None);
    assert_eq!(robot.machine.mode(), Mode::Ready, "nobody asked for a jump");
}

#[test]
fn walk_in_c_repeats_the_library() {
    let mut robot = Robot::ready();
    robot.step(Request::Walk);
    robot.pass(1.5, VELOCITIES[0]);
    robot.step(Request::Turn);
    robot.pass(2.0, VELOCITIES[1]);
    robot.step(Request::Undefined);
    assert!(!robot.step(Request::SetAgain), "while it walks");
    for step in 0..500 {
        robot.step_with(Request::None, |x| {
            x[14] += 0.01 * (step as f64 * 0.1).sin();
            x[16] += 0.03 * (step as f64 * 0.07).sin();
        });
    }
    robot.step(Request::Stop);
    robot.pass(0.4, [0.0; 3]);
    robot.until(Mode::Recover);
    robot.until(Mode::Ready);
    assert!(robot.step(Request::SetAgain));
    robot.step(Request::Beyond);
    robot.pass(1.0, [0.2, 0.0, 0.2]);
    robot.step_with(Request::None, |x| x[15] = 3.0);
    for _ in 0..20 {
        robot.step_with(Request::None, |x| x[15] = 3.0);
    }
    assert_eq!(robot.machine.mode(), Mode::Damp);
    robot.step(Request::Reset);
    robot.step(Request::Stand);
    robot.step(Request::Damp);
    let emitted = Emitted::with_library_sines(&shipped("go1-trot-d6"));
    let replay = root().join("tests/controller_c/machine.c");
    let program = emitted.program("cc", &["-DWALKS"], replay.to_str().expect("UTF-8"));
    let file = emitted.scratch.path().join("steps");
    fs::write(&file, &robot.bytes).expect("written");
    let tolerance = TOLERANCE.to_string();
    let output = succeed(
        std::process::Command::new(program)
            .arg(&file)
            .arg(tolerance),
    );
    println!("{}", String::from_utf8_lossy(&output.stdout));
}
