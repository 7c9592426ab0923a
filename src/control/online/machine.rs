//! A state machine around the controller: stand up, be ready, jump, land, recover, walk, damp.
//!
//! In: every measurement, in the robot's own world and on its own clock, and requests. Out: a command of the same kind
//! as the controller's. The joints move on a smooth curve to the reference's first posture, with the torques that carry
//! the weight. A jump begins at the place where the robot then stands. The supervisor monitors every mode, and its
//! fault leads to [`Mode::Damp`] until a reset. Read [`Machine::step_into`] first, `routine` for the transitions.

use super::command::{Command, Source, Status};
use super::controller::{Controller, Measurement};
use super::error::ControlError;
use super::routine::{Mode, Routine, Timing, write_support};
use super::settings::Accepts;
use super::step::watched;
use super::supervisor::Fault;
use super::walk::{Strides, Walk};
use crate::robot::{GRAVITY_M_S2, JOINT_DIM, LEG_JOINT_DIM, Leg, STATE_DIM};

/// The controller with the state machine around it. References are set on [`Machine::controller_mut`], before a jump.
#[derive(Debug)]
pub struct Machine {
    controller: Controller,
    timing: Timing,
    routine: Routine,
    walk: Option<Walk>,
}

impl Machine {
    /// A state machine in [`Mode::Damp`] around a controller; an error names a time that is not positive.
    pub fn new(controller: Controller, timing: Timing) -> Result<Self, ControlError> {
        let times = [
            ("stand_s", timing.stand_s),
            ("settle_s", timing.settle_s),
            ("range_s", timing.range_s),
        ];
        for (name, found) in times {
            Accepts::Positive.check(name, found)?;
        }
        Ok(Self {
            controller,
            timing,
            routine: Routine::default(),
            walk: None,
        })
    }

    /// The present mode.
    pub fn mode(&self) -> Mode {
        self.routine.mode
    }

    /// The controller.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The controller, for example to set its reference.
    pub fn controller_mut(&mut self) -> &mut Controller {
        &mut self.controller
    }

    /// Stands up from [`Mode::Damp`], or moves from [`Mode::Ready`] to the start of another reference; false in other
    /// modes, after a fault and without a reference.
    pub fn stand(&mut self, time_s: f64, x: &[f64]) -> bool {
        let has_fault = self.controller.supervisor.fault != Fault::None;
        let (mode, from) = match (self.routine.mode, x.first_chunk::<JOINT_DIM>()) {
            (Mode::Damp, Some(joints)) if !has_fault => (Mode::StandUp, *joints),
            (Mode::Ready, _) => (Mode::Recover, self.routine.stand),
            _ => return false,
        };
        if !(time_s.is_finite() && from.iter().all(|joint| joint.is_finite())) {
            return false;
        }
        let is_walk = self.follows_walk();
        if let (true, Some(walk)) = (is_walk, &mut self.walk) {
            walk.stand(&mut self.controller);
        }
        let Some(start) = self.start() else {
            return false;
        };
        self.routine.stand.copy_from_slice(&start[..JOINT_DIM]);
        self.routine.enter(mode, time_s, &from);
        self.controller.forget();
        true
    }

    /// Jumps with the next measurement: from [`Mode::Ready`] at the start of the reference, or from [`Mode::Damp`] if
    /// another program made the robot stand there. False in other modes, after a fault, and without a reference.
    pub fn jump(&mut self) -> bool {
        let is_sound = self.controller.supervisor.fault == Fault::None;
        let mode = self.routine.mode;
        let may_start = |start: [f64; STATE_DIM]| match mode {
            Mode::Ready => start[..JOINT_DIM] == self.routine.stand,
            _ => mode == Mode::Damp && is_sound,
        };
        let is_jump = !self.follows_walk();
        self.routine.asks_walk = false;
        self.routine.is_asked = is_jump && self.start().is_some_and(may_start);
        self.routine.is_asked
    }

    /// Sets the strides of a model as the reference. The controller needs settings for walks.
    ///
    /// # Errors
    /// Errors of the strides as a reference, a horizon that is too long for a walk, feet that select no phase, or a
    /// robot that jumps or walks.
    pub fn set_walk(&mut self, strides: Strides) -> Result<(), ControlError> {
        if let Mode::Jump | Mode::Land | Mode::Walk = self.routine.mode {
            return Err(ControlError::Setting {
                name: "mode",
                found: f64::from(self.routine.mode as u8),
                expected: "one in which the robot stands or is damped",
            });
        }
        self.routine.is_asked = false;
        self.walk = Some(Walk::new(strides, &mut self.controller)?);
        Ok(())
    }

    /// Walks at a velocity along the heading, to the left (m/s) and of yaw (rad/s). The velocity is clamped to the
    /// range of the strides and reached in [`Timing::range_s`] at most. A walk starts from [`Mode::Ready`] at the stand
    /// of the walk, or from [`Mode::Damp`] if another program made the robot stand there. In [`Mode::Walk`] the
    /// velocity replaces the last one. False in other modes, after a fault, without strides, and for numbers that are
    /// not finite.
    pub fn walk(&mut self, velocity: [f64; 3]) -> bool {
        let is_sound = self.controller.supervisor.fault == Fault::None;
        let may = self.follows_walk() && velocity.iter().all(|number| number.is_finite());
        let Some(walk) = self.walk.as_mut().filter(|_| may) else {
            return false;
        };
        let is_there = self.routine.stand == walk.strides.gait.stand[..JOINT_DIM];
        match self.routine.mode {
            Mode::Walk => {}
            Mode::Ready if is_there => self.routine.is_asked = true,
            Mode::Damp if is_sound => self.routine.is_asked = true,
            _ => return false,
        }
        if self.routine.is_asked {
            self.routine.asks_walk = true;
            walk.stand(&mut self.controller);
        }
        walk.walker.command(&walk.strides.gait, &velocity);
        true
    }

    /// Slows down, stands, and moves the joints back to the stand: [`Mode::Recover`], then [`Mode::Ready`]. Also
    /// cancels a walk that was requested and has not begun. False in other modes than [`Mode::Walk`].
    pub fn stop(&mut self) -> bool {
        if self.routine.is_asked && self.routine.asks_walk {
            self.routine.is_asked = false;
            return true;
        }
        match &mut self.walk {
            Some(walk) if self.routine.mode == Mode::Walk => {
                walk.walker.stop();
                true
            }
            _ => false,
        }
    }

    fn follows_walk(&self) -> bool {
        (self.controller.reference()).is_some_and(|reference| reference.is_walk)
    }

    /// Damps the joints, in any mode.
    pub fn damp(&mut self) {
        (self.routine.mode, self.routine.is_asked) = (Mode::Damp, false);
    }

    /// Forgets the supervisor's fault, plan and measurements, and damps the joints.
    pub fn reset(&mut self) {
        self.controller.reset();
        self.routine = Routine::default();
    }

    /// See [`Controller::prepare`].
    pub fn prepare(&mut self, time_s: f64) {
        if let Mode::Jump | Mode::Land | Mode::Walk = self.routine.mode {
            self.controller.prepare(time_s - self.routine.offset_s);
        }
    }

    /// Computes the command for a measurement in the robot's world, on its clock.
    pub fn step_into(&mut self, measurement: Measurement<'_>, command: &mut Command) {
        let is_whole = measurement.x.len() == STATE_DIM && measurement.dx.len() == STATE_DIM;
        let Measurement { time_s, x, dx, .. } = measurement;
        // The reference may have been replaced since the request.
        let asks_this = self.routine.asks_walk == self.follows_walk();
        self.routine.is_asked = self.routine.is_asked && asks_this;
        if self.routine.mode == Mode::Walk && !self.follows_walk() {
            self.damp();
        }
        let starts = self.routine.is_asked && is_whole;
        if starts && self.controller.memory.accepts(time_s, x, dx) {
            let start = self.start().expect("a request was accepted");
            let reference = self.controller.reference().expect("it has one");
            let (mode, start_s) = match reference.is_walk {
                true => (Mode::Walk, 0.0),
                false => (Mode::Jump, reference.start_s()),
            };
            self.routine.leap(mode, time_s, start_s, x, &start);
            self.controller.forget();
        }
        match self.routine.mode {
            Mode::Jump | Mode::Land | Mode::Walk => self.follow(measurement, is_whole, command),
            Mode::StandUp | Mode::Ready | Mode::Recover => self.hold(measurement, command),
            Mode::Damp => self.damped(measurement, command),
        }
    }

    fn start(&self) -> Option<[f64; STATE_DIM]> {
        let reference = self.controller.reference()?;
        Some(reference.robot_state_at(reference.start_s()))
    }

    /// A step of the controller, in its frame and on its clock.
    fn follow(&mut self, measurement: Measurement<'_>, is_whole: bool, command: &mut Command) {
        let (routine, mut x, mut dx) = (&mut self.routine, [0.0; STATE_DIM], [0.0; STATE_DIM]);
        let time_s = measurement.time_s - routine.offset_s;
        if is_whole {
            routine.write_in_frame(measurement.x, measurement.dx, &mut x, &mut dx);
        }
        let walk = self.walk.as_mut().filter(|_| routine.mode == Mode::Walk);
        if let Some(walk) = walk {
            walk.extend(&mut self.controller, time_s, self.timing.range_s);
            walk.walker.move_to_path(time_s, &mut x, &mut dx);
        }
        let width = if is_whole { STATE_DIM } else { 0 };
        let framed = Measurement {
            time_s,
            x: &x[..width],
            dx: &dx[..width],
            feet: measurement.feet,
        };
        self.controller.step_into(framed, command);
        if command.source == Source::Damping {
            routine.mode = Mode::Damp;
        } else if command.status.has_plan()
            && let Some(reference) = self.controller.reference()
        {
            let (timing, feet) = (&self.timing, &measurement.feet);
            let mode = match (routine.mode, &self.walk) {
                (Mode::Walk, Some(walk)) if walk.walker.rests(time_s) => Mode::Recover,
                (Mode::Walk, _) => Mode::Walk,
                _ => {
                    let is_over = reference.is_over(time_s);
                    routine.after_jump(timing, measurement.time_s, is_over, measurement.dx, feet)
                }
            };
            if mode == Mode::Recover {
                routine.enter(mode, measurement.time_s, &command.joint_position_rad);
                self.controller.forget();
            }
        }
    }

    /// A step in which the joints move to the stand, or hold it.
    fn hold(&mut self, measurement: Measurement<'_>, command: &mut Command) {
        self.controller.begin(command);
        let status = self.stand_status(&measurement);
        let controller = &mut self.controller;
        let status = controller.judged(status, measurement.time_s);
        command.status = status;
        if controller.supervisor.fault != Fault::None {
            (self.routine.mode, self.routine.is_asked) = (Mode::Damp, false);
            controller.damp(measurement.time_s, measurement.x, command);
        } else {
            self.write_stand(&measurement, command);
        }
        let step_s = self.controller.settings.step_s;
        (self.controller.memory).keep_time(measurement.time_s, step_s);
    }

    /// Status of a measurement of a robot that moves to the stand or holds it.
    fn stand_status(&mut self, measurement: &Measurement<'_>) -> Status {
        let (controller, routine) = (&mut self.controller, &mut self.routine);
        let &Measurement { time_s, x, dx, .. } = measurement;
        if x.len() != STATE_DIM || dx.len() != STATE_DIM {
            return Status::WrongDimension;
        }
        if !controller.memory.accepts(time_s, x, dx) {
            return Status::NotFinite;
        }
        // The body may be anywhere, upright; the joints should be where they are sent.
        let mut nominal = [0.0; STATE_DIM];
        nominal.copy_from_slice(x);
        (nominal[15], nominal[16]) = (0.0, 0.0);
        let mut velocity = [0.0; JOINT_DIM];
        routine.write_posture(&self.timing, time_s, &mut nominal, &mut velocity);
        let mut bounds = controller.settings.bounds;
        if routine.mode == Mode::StandUp {
            // A robot that lies on its belly has no foot on the ground and does not fall.
            bounds.contact_mismatch_steps = 0;
        }
        let (supervisor, plant) = (&mut controller.supervisor, &controller.plant);
        if !watched(
            supervisor,
            plant,
            &bounds,
            (&nominal, measurement),
            measurement.feet,
        ) {
            controller.memory.joint_velocity = [0.0; JOINT_DIM];
            return Status::MeasurementJump;
        }
        let (timing, feet) = (&self.timing, &measurement.feet);
        let mode = routine.after_standing(&bounds, timing, time_s, x, dx, feet);
        if mode == Mode::Damp {
            controller.supervisor.fault = Fault::NotAtStart;
        }
        routine.mode = mode;
        Status::Standing
    }

    /// Writes the posture of the stand and, for a valid measurement, the torques that carry the weight.
    fn write_stand(&mut self, measurement: &Measurement<'_>, command: &mut Command) {
        let controller = &mut self.controller;
        let (robot, limits) = (controller.plant.robot(), controller.plant.joint_limits());
        let step_s = controller.settings.step_s;
        let now_s = controller.memory.now_s(measurement.time_s, step_s);
        let (mut joints, mut velocity) = ([0.0; JOINT_DIM], [0.0; JOINT_DIM]);
        let share = (self.routine).write_posture(&self.timing, now_s, &mut joints, &mut velocity);
        if command.status == Status::Standing {
            let down = Leg::down(measurement.feet).count().max(1) as f64;
            let force = share * (robot.mass_kg() * GRAVITY_M_S2) / down;
            let mut torque = [0.0; JOINT_DIM];
            for leg in Leg::down(measurement.feet) {
                let first = leg.index() * LEG_JOINT_DIM;
                let (shape, hip) = (&robot.geometry(leg).shape, robot.hip_position(leg));
                let (q, of_leg) = (&measurement.x[first..], &mut torque[first..]);
                write_support(shape, hip.as_slice(), measurement.x, q, force, of_leg);
            }
            let limit = robot.torque_limit_nm();
            (controller.memory).keep_torque(&torque, 1.0, limit);
        }
        (controller.memory).keep_posture(&joints, &limits[0], &limits[1]);
        command.torque_nm = controller.memory.feed_forward_nm;
        command.joint_position_rad = controller.memory.joint_position;
        command.joint_velocity_rad_s = velocity;
        command.losses_nm = [0.0; JOINT_DIM];
        command.u_lat.fill(0.0);
        command.source = Source::Stand;
    }

    /// A step of damped joints.
    fn damped(&mut self, measurement: Measurement<'_>, command: &mut Command) {
        let controller = &mut self.controller;
        controller.begin(command);
        let &Measurement { time_s, x, dx, .. } = &measurement;
        let is_whole = x.len() == STATE_DIM && dx.len() == STATE_DIM;
        let is_finite = is_whole && controller.memory.accepts(time_s, x, dx);
        let status = match (is_whole, is_finite) {
            (true, true) => Status::Damped,
            (true, false) => Status::NotFinite,
            (false, _) => Status::WrongDimension,
        };
        command.status = Status::of(controller.supervisor.fault).unwrap_or(status);
        controller.damp(time_s, x, command);
        let step_s = controller.settings.step_s;
        (controller.memory).keep_time(time_s, step_s);
    }
}
