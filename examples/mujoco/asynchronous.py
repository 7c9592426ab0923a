"""An asynchronous jump: the front feet leave first, the rear feet push on alone.

While only the rear feet stand, two force components in the sagittal plane must
control three quantities. Pitch and height have priority; the forward force
follows from the balance of pitch. The robot therefore pitches up over all feet
first. The rear push, directed ahead through the centre of mass, carries it forward.
"""

from dataclasses import dataclass

import numpy as np

from body_control import WRENCH_WEIGHTS
from jump_controller import JumpController, JumpPlan
from trajectories import Cubic, Quintic

FRONT = np.array([True, True, False, False])
UNLOADING_S = 0.04
FRONT_EFFORT = 200.0
REAR_WEIGHTS = (0.05, 1, 2, 8, 8, 8)


@dataclass(frozen=True)
class AsynchronousPlan(JumpPlan):
    """Adds the two parts of the thrust; pitch is positive nose down (rad, rad/s)."""

    front_duration_s: float = 0.16
    front_velocity: tuple = (0.2, 0.0, 0.6)
    front_pitch_rate: float = -1.6
    rear_duration_s: float = 0.19
    rear_acceleration: float = 2.0
    takeoff_pitch_rad: float = -0.15
    front_tuck_m: float = 0.06


class SplitThrust:
    """References of centre of mass and pitch over both parts, integrated from accelerations."""

    STEP_S = 0.0005

    def __init__(self, start, plan):
        front, rear = plan.front_duration_s, plan.rear_duration_s
        self.release_s, self.duration_s = front, front + rear
        self.time_s = np.arange(0.0, self.duration_s + self.STEP_S, self.STEP_S)
        mean = 1.0 / (0.875 * front)
        x, y, z = (mean * v for v in plan.front_velocity)
        knots = [0.0, 0.25 * front, front, front + 0.04, front + 0.75 * rear, front + rear]
        level = [
            (0, x, x, 0, 0, 0),
            (0, y, y, 0, 0, 0),
            (0, z, z, plan.rear_acceleration, plan.rear_acceleration, -9.81),
        ]
        self.acceleration = np.array([np.interp(self.time_s, knots, values) for values in level])
        self.velocity = self.STEP_S * np.cumsum(self.acceleration, axis=1)
        self.position = np.array(start)[:, None] + self.STEP_S * np.cumsum(self.velocity, axis=1)
        self.plan = plan

    def at(self, time_s):
        return tuple(
            np.array([np.interp(time_s, self.time_s, row) for row in rows])
            for rows in (self.position, self.velocity, self.acceleration)
        )

    def pitch(self, time_s):
        """(angle, rate): speeds up to the front release, then a cubic to the take-off pitch."""
        plan, front, rear = self.plan, self.release_s, self.plan.rear_duration_s
        rate, half = plan.front_pitch_rate, 0.5 * plan.front_pitch_rate * front
        if time_s <= front:
            share = time_s / front
            return half * share**2, rate * share
        t = min((time_s - front) / rear, 1.0)
        a, b, c, d = half, rate * rear, plan.takeoff_pitch_rad, plan.takeoff_pitch_rate * rear
        angle = (
            a * (1 - 3 * t**2 + 2 * t**3)
            + b * (t - 2 * t**2 + t**3)
            + c * (3 * t**2 - 2 * t**3)
            + d * (t**3 - t**2)
        )
        speed = (c - a) * (6 * t - 6 * t**2) + b * (1 - 4 * t + 3 * t**2) + d * (3 * t**2 - 2 * t)
        return angle, speed / rear


class AsynchronousController(JumpController):
    """Torques of a jump whose front feet are released `rear_duration_s` before the rear ones."""

    FRICTION_SHARE = 0.8
    TUCK_SHARE = 0.45
    TUCK_MOTION = Cubic
    SWING_FEED_FORWARD = 0.6

    def _plan_thrust(self):
        self.thrust = SplitThrust(self.crouch.goal, self.plan)
        self.front_swing = None

    def _push_off(self, elapsed):
        reference = self.thrust.at(elapsed)
        angle, rate = self.thrust.pitch(elapsed)
        attitude = (
            np.array([self.plan.roll_rad, angle, self.plan.yaw_rad]),
            np.array([0.0, rate, 0.0]),
        )
        before = self.thrust.release_s - elapsed
        if before > 0.0:
            unloaded = np.clip(1.0 - before / UNLOADING_S, 0.0, 1.0)
            effort = np.where(FRONT, FRONT_EFFORT**unloaded, 1.0)
            weights = (
                np.array(WRENCH_WEIGHTS) ** (1 - unloaded) * np.array(REAR_WEIGHTS) ** unloaded
            )
            return self._stand_on(reference, attitude, weights=weights, effort=effort)
        pushing = self._stand_on(reference, attitude, ~FRONT, weights=REAR_WEIGHTS)
        return np.where(np.repeat(FRONT, 3), self._lift_front(-before), pushing)

    def _lift_front(self, elapsed):
        body, robot, plan = self.body, self.robot, self.plan
        if self.front_swing is None:
            goal = body.joints.copy()
            for leg in np.flatnonzero(FRONT):
                foot = (0.02, robot.hip_offset_m[leg], plan.front_tuck_m - plan.landing_leg_m)
                goal[3 * leg : 3 * leg + 3] = robot.joints_for_foot(leg, foot)
            self.front_swing = Quintic(body.joints, body.joint_rates, goal, plan.rear_duration_s)
        return self._follow(self.front_swing.at(elapsed))
