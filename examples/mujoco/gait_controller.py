"""Walks by a wrench: a gait clock, Raibert foot placement, stance by forces, swing by joint PD.

The standing feet share a wrench on the body that tracks speed, height and attitude. A swinging
foot follows a cycloid to its place. A foot that touches early stands; one that is late is lowered.
"""

from dataclasses import dataclass, field

import numpy as np

from body_control import BodyControl
from countermovement import rotation_from_rpy
from gait_clock import Gait, cycloid
from simulation import CONTROL_STEP_S

VELOCITY_GAIN, POSITION_GAIN, POSITION_REACH_M = 8.0, 20.0, 0.05
HEIGHT_GAINS = (90.0, 16.0)
TILT_GAINS = (160.0, 22.0)
YAW_GAINS = (60.0, 14.0)
SWING_GAINS = (45.0, 1.2)
PLACEMENT_GAIN_S = 0.06
EARLY_PROGRESS = 0.6
LOWERING_SPEED = 0.3
RAMP_S = 0.6
RANDOM_TORQUE_S = 0.02


@dataclass(frozen=True)
class GaitPlan:
    """Parameters of one walk: velocity (m/s) along and across the heading, yaw rate (rad/s),
    heights of the trunk and of swinging feet (m), bound of the random joint torques (N m)."""

    gait: Gait = field(default_factory=Gait)
    velocity: tuple = (0.4, 0.0)
    yaw_rate: float = 0.0
    height_m: float = 0.27
    swing_height_m: float = 0.06
    random_torque_nm: float = 0.3


class GaitController:
    """Torques of a walk; it stands until `start_s`, then the speed ramps up."""

    def __init__(self, robot, plan, start_s, seed=0):
        self.robot, self.plan, self.start_s = robot, plan, start_s
        self.body = BodyControl(robot)
        self.random = np.random.default_rng(seed)
        self.random_torque = np.zeros(12)
        self.steps = 0
        self.place = self.yaw = None
        self.stood = np.ones(4, bool)
        self.lift_off = np.zeros((4, 3))
        self.swing_joints = np.full(12, np.nan)

    def torque(self, time_s, x, dx, feet):
        """(12,) torques for the state measured now; called once every control step, in order."""
        self.body.update(x, dx)
        self._advance(time_s)
        standing, progress = self.plan.gait.at(time_s - self.start_s)
        stance = self._stance(standing, progress, feet)
        torque = self.body.torques_for(self._forces(time_s, stance))
        for leg in np.flatnonzero(~stance):
            swing = self._swing(leg, standing[leg], progress[leg])
            torque[3 * leg : 3 * leg + 3] += swing
        self.swing_joints[np.repeat(stance, 3)] = np.nan
        self.stood = stance
        return torque + self._noise()

    def _advance(self, time_s):
        """Moves the reference of place and heading on by one control step."""
        plan, body = self.plan, self.body
        if self.place is None:
            self.place, self.yaw = body.com[:2].copy(), body.rpy[2]
        ramp = np.clip((time_s - self.start_s) / RAMP_S, 0.0, 1.0)
        self.yaw_rate = ramp * plan.yaw_rate
        self.yaw += self.yaw_rate * CONTROL_STEP_S
        self.heading = rotation_from_rpy((0.0, 0.0, self.yaw))
        self.velocity = self.heading[:2, :2] @ (ramp * np.array(plan.velocity))
        lag = self.place + self.velocity * CONTROL_STEP_S - body.com[:2]
        self.place = body.com[:2] + np.clip(lag, -POSITION_REACH_M, POSITION_REACH_M)

    def _stance(self, standing, progress, feet):
        """(4,) feet that carry: those to stand that have touched, and those that touch early."""
        early = ~standing & ~self.stood & feet & (progress > EARLY_PROGRESS)
        kept = ~standing & self.stood & (progress > EARLY_PROGRESS)
        stance = (standing & (feet | self.stood)) | early | kept
        lifted = self.stood & ~stance
        self.lift_off[lifted] = self.body.feet[lifted]
        return stance

    def _wrench(self, time_s):
        """(6,) force and moment about the centre of mass that track the reference."""
        body, plan = self.body, self.plan
        acceleration = np.zeros(3)
        acceleration[:2] = VELOCITY_GAIN * (self.velocity - body.com_velocity[:2])
        acceleration[:2] += POSITION_GAIN * (self.place - body.com[:2])
        stiffness, damping = HEIGHT_GAINS
        height, rise, push = plan.gait.bounce(time_s - self.start_s)
        acceleration[2] = push + stiffness * (plan.height_m + height - body.trunk[2])
        acceleration[2] += damping * (rise - body.com_velocity[2])
        tilt = TILT_GAINS[0] * -body.rpy[:2] - TILT_GAINS[1] * (self.heading.T @ body.omega)[:2]
        off = (self.yaw - body.rpy[2] + np.pi) % (2 * np.pi) - np.pi
        turn = YAW_GAINS[0] * off + YAW_GAINS[1] * (self.yaw_rate - body.omega[2])
        return body.wrench_for(acceleration, self.heading @ np.array([*tilt, turn]))

    def _forces(self, time_s, stance):
        """(4, 3) forces of the standing feet; one that touches early carries its share."""
        together = self.plan.gait.together if time_s >= self.start_s else 4
        share = min(1.0, stance.sum() / together)
        return self.body.foot_forces(share * self._wrench(time_s), stance)

    def _swing(self, leg, late, progress):
        """(3,) torques that move a foot along its cycloid, or down when it is late."""
        body, robot, plan = self.body, self.robot, self.plan
        if late:
            target = self._landing(leg, 0.0)
            target[2] -= LOWERING_SPEED * progress * plan.gait.stance_s
        else:
            left_s = (1.0 - progress) * plan.gait.swing_s
            target = cycloid(
                self.lift_off[leg], self._landing(leg, left_s), plan.swing_height_m, progress
            )
        foot = body.rotation.T @ (target - body.trunk) - robot.hip_position_m[leg]
        joints = slice(3 * leg, 3 * leg + 3)
        wanted = robot.joints_for_foot(leg, foot)
        before = self.swing_joints[joints].copy()
        rates = (wanted - before) / CONTROL_STEP_S if np.isfinite(before).all() else np.zeros(3)
        self.swing_joints[joints] = wanted
        stiffness, damping = SWING_GAINS
        rates = damping * (rates - body.joint_rates[joints])
        return stiffness * (wanted - body.joints[joints]) + rates

    def _landing(self, leg, left_s):
        """(3,) place on the floor for a foot that touches down in `left_s`."""
        body, robot, plan = self.body, self.robot, self.plan
        ahead = rotation_from_rpy((0.0, 0.0, body.rpy[2] + self.yaw_rate * left_s))
        hip = robot.hip_position_m[leg] + [0.0, robot.hip_offset_m[leg], 0.0]
        arm = (ahead @ hip)[:2]
        turning = self.yaw_rate * np.array([-arm[1], arm[0]])
        velocity = body.com_velocity[:2]
        place = body.trunk[:2] + velocity * left_s + arm
        place = place + 0.5 * plan.gait.stance_s * (velocity + turning)
        place = place + PLACEMENT_GAIN_S * (velocity - self.velocity)
        return np.array([*place, robot.foot_radius_m])

    def _noise(self):
        """(12,) random torques, drawn anew every 20 ms."""
        if self.steps % round(RANDOM_TORQUE_S / CONTROL_STEP_S) == 0:
            size = self.plan.random_torque_nm
            self.random_torque = size * self.random.uniform(-1.0, 1.0, 12)
        self.steps += 1
        return self.random_torque
