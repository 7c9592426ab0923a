"""A second way to jump: one countermovement without a stop, and legs that are springs.

The trunk follows a spline from standing through the bottom of a dip, where it is
accelerating upwards already, to take-off. Every leg is a Cartesian spring and
damper between the trunk and the place its foot stands on. The least forces that
produce the wanted acceleration of the trunk are added. Friction, the centre of
mass and the losses of the joints are not modelled. Only the measured state is
shared with `jump_controller`.
"""

from dataclasses import dataclass

import numpy as np

from simulation import euler_rate_map
from trajectories import QuinticSpline

GRAVITY = np.array([0.0, 0.0, 9.81])
TOUCHDOWN_AFTER_S = 0.08
REST_S = 0.10


@dataclass(frozen=True)
class CountermovementPlan:
    """Parameters of one jump: heights of the trunk in m, accelerations in m/s^2, rates in m/s.

    `thrust_travel` is the way of the thrust along the floor over take-off speed times duration.
    Gains of a leg are in N/m and N s/m at the foot, those of flight in N m/rad and N m s/rad.
    """

    stand_height_m: float = 0.29
    hold_s: float = 0.03
    dip_height_m: float = 0.215
    dip_shift_m: float = -0.01
    dip_pitch_rad: float = 0.0
    dip_duration_s: float = 0.24
    bottom_acceleration: float = 6.0
    thrust_duration_s: float = 0.17
    thrust_travel: float = 0.45
    takeoff_height_m: float = 0.32
    takeoff_velocity: tuple = (0.6, 0.0, 1.3)
    takeoff_pitch_rad: float = 0.0
    takeoff_yaw_rad: float = 0.0
    leg_stiffness: float = 2200.0
    leg_damping: float = 45.0
    flight_stiffness: float = 30.0
    flight_damping: float = 0.9
    retraction_m: float = 0.02
    landing_leg_m: float = 0.265
    landing_reach_s: float = 0.07
    landing_stiffness: float = 1500.0
    landing_damping: float = 55.0
    landing_duration_s: float = 0.30
    final_height_m: float = 0.28


class CountermovementController:
    """Torques of a countermovement jump, all feet at once."""

    def __init__(self, robot, plan, start_s=0.0):
        self.robot, self.plan, self.start_s = robot, plan, start_s
        self.stage = "start"
        self.stage_start_s = 0.0

    def torque(self, time_s, x, dx, feet):
        """(12,) torques for the state measured now; called once every control step, in order."""
        self._measure(x, dx)
        self._advance(time_s, feet)
        elapsed = time_s - self.stage_start_s
        plan = self.plan
        if self.stage == "stance":
            return self._stand(self.motion.at(elapsed), plan.leg_stiffness, plan.leg_damping, feet)
        if self.stage == "flight":
            return self._swing(elapsed)
        landing = (plan.landing_stiffness, plan.landing_damping)
        standing = self._stand(self.motion.at(elapsed), *landing, feet)
        return np.where(np.repeat(self.landed, 3), standing, self._swing(self.flight_s))

    def rest_s(self, otherwise_s):
        """When the landing motion is over (s); `otherwise_s` if the robot never landed."""
        if self.stage != "landing":
            return otherwise_s
        return min(self.stage_start_s + self.plan.landing_duration_s + REST_S, otherwise_s)

    def _measure(self, x, dx):
        self.joints, self.joint_rates = x[:12], dx[:12]
        self.pose, self.twist = x[12:], dx[12:]
        self.rotation = rotation_from_rpy(x[15:])
        places = [self.robot.foot_position(leg, x[3 * leg : 3 * leg + 3]) for leg in range(4)]
        # From the trunk's frame to the feet, in the trunk's axes.
        self.arms = self.robot.hip_position_m + np.array(places)

    def _feet(self):
        """(4, 3) feet in the world."""
        return self.pose[:3] + self.arms @ self.rotation.T

    def _advance(self, time_s, feet):
        elapsed = time_s - self.stage_start_s
        if self.stage == "start":
            self._enter("stance", time_s)
            self._plan_jump()
        elif self.stage == "stance" and elapsed > self.thrust_start_s:
            if elapsed >= self.takeoff_s or not feet.any():
                self._enter("flight", time_s)
                self._plan_swing()
        elif self.stage == "flight" and elapsed > TOUCHDOWN_AFTER_S and feet.any():
            self._enter("landing", time_s)
            self._plan_landing()
        if self.stage == "landing":
            newly = (feet | (time_s - self.stage_start_s > 0.05)) & ~self.landed
            self.anchors[newly] = self._feet()[newly]
            self.landed |= newly

    def _enter(self, stage, time_s):
        self.stage, self.stage_start_s = stage, time_s

    def _plan_jump(self):
        """Trunk pose (x, y, z, roll, pitch, yaw) from standing over the dip to take-off."""
        plan = self.plan
        self.anchors = self._feet()
        middle = self.anchors[:, :2].mean(axis=0)
        vx, vy, vz = plan.takeoff_velocity
        span = plan.thrust_duration_s
        x = middle[0] + plan.dip_shift_m
        y = middle[1]
        ahead, aside = plan.thrust_travel * span * np.array([vx, vy])
        bottom = np.array([x, y, plan.dip_height_m, 0, plan.dip_pitch_rad, 0])
        upwards = np.array([0, 0, plan.bottom_acceleration, 0, 0, 0])
        takeoff = [x + ahead, y + aside, plan.takeoff_height_m]
        takeoff = np.array([*takeoff, 0, plan.takeoff_pitch_rad, plan.takeoff_yaw_rad])
        velocity = np.array([vx, vy, vz, 0, 0, 0])
        falling = np.array([0, 0, -GRAVITY[2], 0, 0, 0])
        down_s = self.start_s + plan.hold_s
        self.thrust_start_s = down_s + plan.dip_duration_s
        self.takeoff_s = self.thrust_start_s + span
        settled = np.concatenate([[middle[0], y, plan.stand_height_m], np.zeros(3)])
        self.motion = QuinticSpline(
            [
                (0.0, self.pose, 0.0, 0.0),
                (down_s, settled, 0.0, 0.0),
                (self.thrust_start_s, bottom, 0.0, upwards),
                (self.takeoff_s, takeoff, velocity, falling),
            ]
        )

    def _plan_swing(self):
        """Joints from take-off over legs drawn up a little to the landing posture."""
        plan, robot = self.plan, self.robot
        rise = self.twist[2]
        drop = self.pose[2] - plan.landing_leg_m - robot.foot_radius_m
        g = GRAVITY[2]
        self.flight_s = (rise + np.sqrt(max(rise * rise + 2 * g * drop, 0.0))) / g
        reach = plan.landing_reach_s * self.twist[:2]
        landing, drawn = np.zeros(12), np.zeros(12)
        for leg in range(4):
            joints = slice(3 * leg, 3 * leg + 3)
            side = robot.hip_offset_m[leg]
            foot = np.array([reach[0], side + reach[1], -plan.landing_leg_m])
            landing[joints] = robot.joints_for_foot(leg, foot)
            drawn[joints] = robot.joints_for_foot(leg, foot + [0.0, 0.0, plan.retraction_m])
        self.swing = QuinticSpline(
            [
                (0.0, self.joints, self.joint_rates, 0.0),
                (0.6 * self.flight_s, drawn, 0.0, 0.0),
                (0.95 * self.flight_s, landing, 0.0, 0.0),
            ]
        )

    def _swing(self, elapsed):
        position, velocity, _ = self.swing.at(elapsed)
        stiffness, damping = self.plan.flight_stiffness, self.plan.flight_damping
        return stiffness * (position - self.joints) + damping * (velocity - self.joint_rates)

    def _plan_landing(self):
        plan = self.plan
        self.landed = np.zeros(4, bool)
        self.anchors = self._feet()
        middle = self.anchors[:, :2].mean(axis=0)
        goal = np.array([*middle, plan.final_height_m, 0, 0, self.pose[5]])
        self.motion = QuinticSpline(
            [
                (0.0, self.pose, self.twist, 0.0),
                (plan.landing_duration_s, goal, 0.0, 0.0),
            ]
        )

    def _stand(self, reference, stiffness, damping, feet):
        """Torques of legs that pull the trunk to a reference pose with springs and dampers."""
        pose, rates, acceleration = reference
        wanted = rotation_from_rpy(pose[3:])
        omega = np.linalg.solve(euler_rate_map(pose[3:]), rates[3:])
        forces = self._feed_forward(acceleration[:3], feet)
        torque = np.zeros(12)
        for leg in range(4):
            joints = slice(3 * leg, 3 * leg + 3)
            jacobian = self.robot.foot_jacobian(leg, self.joints[joints])
            # Where the foot would be, and how it would move, if the trunk were on its reference.
            arm = wanted.T @ (self.anchors[leg] - pose[:3])
            motion = -wanted.T @ rates[:3] - np.cross(omega, arm)
            spring = stiffness * (arm - self.arms[leg])
            damper = damping * (motion - jacobian @ self.joint_rates[joints])
            push = spring + damper - self.rotation.T @ forces[leg]
            torque[joints] = jacobian.T @ push
        return torque

    def _feed_forward(self, acceleration, feet):
        """(4, 3) least forces on the standing feet (world) that accelerate the trunk's origin so
        and turn nothing."""
        forces = np.zeros((4, 3))
        legs = np.flatnonzero(feet)
        if len(legs) < 3:
            return forces
        arms = self.arms[legs] @ self.rotation.T
        balance = np.zeros((6, 3 * len(legs)))
        for index, (x, y, z) in enumerate(arms):
            columns = slice(3 * index, 3 * index + 3)
            balance[:3, columns] = np.eye(3)
            balance[3:, columns] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
        wrench = np.concatenate([self.robot.mass_kg * (acceleration + GRAVITY), np.zeros(3)])
        forces[legs] = (np.linalg.pinv(balance) @ wrench).reshape(-1, 3)
        return forces


def rotation_from_rpy(rpy):
    """(3, 3) from trunk axes to the world, Rz Ry Rx."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
