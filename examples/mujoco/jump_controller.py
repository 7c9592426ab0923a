"""A jump: crouch, thrust, flight, landing; each a stage with its own reference.

On the floor the centre of mass follows a reference (feed-forward acceleration
and PD), in the air the joints follow one. `JumpPlan` has the parameters,
`JumpController.torque` computes torques from measurements alone.
"""

from dataclasses import dataclass

import numpy as np

from body_control import BodyControl
from trajectories import Quintic, Thrust

COM_GAINS = (120.0, 16.0)
ATTITUDE_GAINS = (250.0, 26.0)
FLIGHT_GAINS = (50.0, 1.5)
TOUCHDOWN_AFTER_S = 0.08
LOADING_S = 0.03
REST_S = 0.08
ALL_FEET = (True, True, True, True)


@dataclass(frozen=True)
class JumpPlan:
    """Parameters of one jump; heights are of the trunk (m)."""

    stand_height_m: float = 0.27
    crouch_height_m: float = 0.19
    crouch_shift_m: float = 0.0
    takeoff_height_m: float = 0.31
    takeoff_velocity: tuple = (0.6, 0.0, 1.2)
    takeoff_pitch_rate: float = 0.0
    crouch_duration_s: float = 0.36
    hold_s: float = 0.04
    tuck_m: float = 0.03
    landing_leg_m: float = 0.285
    landing_reach_s: float = 0.06
    landing_duration_s: float = 0.40
    final_height_m: float = 0.26
    roll_rad: float = 0.0
    yaw_rad: float = 0.0


class JumpController:
    """Torques of a synchronous jump (all feet leave the floor together)."""

    FRICTION_SHARE = 0.65
    TUCK_SHARE = 0.5
    TUCK_MOTION = Quintic
    SWING_FEED_FORWARD = 0.0

    def __init__(self, robot, plan, start_s=0.0):
        self.robot, self.plan, self.start_s = robot, plan, start_s
        self.body = BodyControl(robot, self.FRICTION_SHARE)
        self.stage = "start"
        self.stage_start_s = 0.0
        self.touched_s = np.full(4, np.nan)
        self.crouch = self.thrust = self.swing = self.landing = None

    def torque(self, time_s, x, dx, feet):
        """(12,) torques for the state measured now; called once every control step, in order."""
        self.body.update(x, dx)
        self._advance(time_s, feet)
        elapsed = time_s - self.stage_start_s
        if self.stage == "crouch":
            return self._stand_on(
                self.crouch.at(elapsed), self._lean(self.crouch.progress(elapsed))
            )
        if self.stage == "thrust":
            return self._push_off(elapsed)
        if self.stage == "flight":
            return self._fly(elapsed)
        return self._land(time_s, elapsed)

    def rest_s(self, otherwise_s):
        """When the landing motion is over (s); `otherwise_s` if the robot never landed."""
        if self.stage != "landing":
            return otherwise_s
        return min(self.stage_start_s + self.plan.landing_duration_s + REST_S, otherwise_s)

    def _enter(self, stage, time_s):
        self.stage, self.stage_start_s = stage, time_s

    def _advance(self, time_s, feet):
        plan = self.plan
        elapsed = time_s - self.stage_start_s
        if self.stage == "start":
            self._enter("crouch", time_s)
            self.wait_s = plan.hold_s + self.start_s
            goal = self._com_with_trunk_at(plan.crouch_shift_m, plan.crouch_height_m)
            self.crouch = Quintic(
                self.body.com, np.zeros(3), goal, plan.crouch_duration_s, self.wait_s
            )
        elif (
            self.stage == "crouch" and elapsed >= self.wait_s + plan.crouch_duration_s + plan.hold_s
        ):
            self._enter("thrust", time_s)
            self._plan_thrust()
        elif self.stage == "thrust" and (elapsed >= self.thrust.duration_s or not feet.any()):
            self._enter("flight", time_s)
            self._plan_swing()
        elif self.stage == "flight" and elapsed > TOUCHDOWN_AFTER_S and feet.any():
            self._enter("landing", time_s)
            self._plan_landing()
        if self.stage == "landing":
            newly = feet & np.isnan(self.touched_s)
            self.touched_s[newly] = time_s
            elapsed = time_s - self.stage_start_s
            if elapsed > 0.06:
                self.touched_s[np.isnan(self.touched_s)] = time_s

    def _com_with_trunk_at(self, shift_m, height_m):
        """Centre of mass (world) with the trunk level at this place over the present feet."""
        body, robot = self.body, self.robot
        centre = body.feet[:, :2].mean(axis=0)
        trunk = np.array([centre[0] + shift_m, centre[1], height_m])
        x = np.concatenate([body.joints, trunk, [0.0, 0.0, body.rpy[2]]])
        for leg in range(4):
            foot = body.feet[leg] - trunk - robot.hip_position_m[leg]
            x[3 * leg : 3 * leg + 3] = robot.joints_for_foot(leg, foot)
        probe = BodyControl(robot)
        probe.update(x, np.zeros(18))
        return probe.com

    def _lean(self, progress):
        plan = self.plan
        angles = np.array([plan.roll_rad, 0.0, plan.yaw_rad])
        return progress * angles, np.zeros(3)

    def _plan_thrust(self):
        plan = self.plan
        rise = self._com_with_trunk_at(0.0, plan.takeoff_height_m)[2] - self.crouch.goal[2]
        self.thrust = Thrust(self.crouch.goal, np.array(plan.takeoff_velocity), rise)

    def _push_off(self, elapsed):
        return self._stand_on(self.thrust.at(elapsed), self._thrust_attitude(elapsed))

    def _thrust_attitude(self, elapsed):
        plan, duration = self.plan, self.thrust.duration_s
        rate = plan.takeoff_pitch_rate * elapsed / duration
        pitch = 0.5 * plan.takeoff_pitch_rate * elapsed**2 / duration
        return np.array([plan.roll_rad, pitch, plan.yaw_rad]), np.array([0.0, rate, 0.0])

    def _stand_on(self, com_reference, attitude_reference, stance=ALL_FEET, **distribution):
        position, velocity, acceleration = com_reference
        body = self.body
        stiffness, damping = COM_GAINS
        wanted = (
            acceleration
            + stiffness * (position - body.com)
            + damping * (velocity - body.com_velocity)
        )
        angles, rates = attitude_reference
        stiffness, damping = ATTITUDE_GAINS
        turn = stiffness * (angles - body.rpy) + damping * (rates - body.omega)
        wrench = body.wrench_for(wanted, turn)
        return body.torques_for(body.foot_forces(wrench, stance, **distribution))

    def _plan_swing(self):
        """Joint references from the take-off posture over a tuck to the landing posture."""
        plan, body, robot = self.plan, self.body, self.robot
        fall = body.com_velocity[2]
        drop = body.trunk[2] - (plan.landing_leg_m + robot.foot_radius_m)
        self.flight_s = (fall + np.sqrt(max(fall * fall + 2 * 9.81 * drop, 0.0))) / 9.81
        reach = plan.landing_reach_s * body.com_velocity
        landing, tucked = np.zeros(12), np.zeros(12)
        for leg in range(4):
            foot = np.array([reach[0], robot.hip_offset_m[leg] + reach[1], -plan.landing_leg_m])
            landing[3 * leg : 3 * leg + 3] = robot.joints_for_foot(leg, foot)
            foot = foot + np.array([-0.5 * reach[0], 0.0, plan.tuck_m])
            tucked[3 * leg : 3 * leg + 3] = robot.joints_for_foot(leg, foot)
        tuck_s = self.TUCK_SHARE * self.flight_s
        extend_s = 0.8 * (self.flight_s - tuck_s)
        self.swing = (
            self.TUCK_MOTION(body.joints, body.joint_rates, tucked, tuck_s),
            Quintic(tucked, np.zeros(12), landing, extend_s),
            tuck_s,
        )

    def _swing_reference(self, elapsed):
        tuck, extend, tuck_s = self.swing
        return tuck.at(elapsed) if elapsed < tuck_s else extend.at(elapsed - tuck_s)

    def _fly(self, elapsed):
        return self._follow(self._swing_reference(elapsed))

    def _follow(self, joint_reference):
        position, velocity, acceleration = joint_reference
        body = self.body
        stiffness, damping = FLIGHT_GAINS
        torque = stiffness * (position - body.joints) + damping * (velocity - body.joint_rates)
        if self.SWING_FEED_FORWARD == 0.0:
            return torque
        return torque + self.SWING_FEED_FORWARD * (body.joint_inertia() @ acceleration)

    def _plan_landing(self):
        plan, body = self.plan, self.body
        goal = self._com_with_trunk_at(0.0, plan.final_height_m)
        self.landing = Quintic(body.com, body.com_velocity, goal, plan.landing_duration_s)
        self.landing_yaw = body.rpy[2]
        self.touchdown_angles = body.rpy.copy()

    def _land(self, time_s, elapsed):
        fade = np.clip(1.0 - elapsed / 0.15, 0.0, 1.0)
        angles = fade * self.touchdown_angles
        angles[2] = self.landing_yaw
        standing = self._stand_on(self.landing.at(elapsed), (angles, np.zeros(3)))
        since = np.nan_to_num(time_s - self.touched_s, nan=0.0)
        loaded = np.repeat(np.clip(since / LOADING_S, 0.0, 1.0), 3)
        return loaded * standing + (1.0 - loaded) * self._fly(self.flight_s)
