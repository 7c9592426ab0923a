"""A second way to trot: feet moved along paths in the trunk's axes by joint PD, without forces.

A standing foot goes back under the trunk at the commanded speed, a swinging one forward on a half
sine. No state of the body is fed back; only the clock is shared with `gait_controller`.
"""

from dataclasses import dataclass, field

import numpy as np

from gait_clock import Gait
from simulation import CONTROL_STEP_S

RAMP_S = 0.8
RANDOM_TORQUE_S = 0.02


@dataclass(frozen=True)
class PositionPlan:
    """Parameters of one walk: velocity (m/s) along and across the trunk, yaw rate (rad/s), heights
    (m). Feet are this far behind the hips and further out; standing feet are pushed this far into
    the floor. Gains of the joints are in N m/rad and N m s/rad."""

    gait: Gait = field(default_factory=Gait)
    velocity: tuple = (0.4, 0.0)
    yaw_rate: float = 0.0
    height_m: float = 0.28
    swing_height_m: float = 0.05
    stiffness: float = 70.0
    damping: float = 1.8
    stance_push_m: float = 0.01
    behind_m: float = 0.0
    wider_m: float = 0.01
    random_torque_nm: float = 0.3


class PositionTrot:
    """Torques of a trot by positions; it stands until `start_s`, then the steps lengthen."""

    def __init__(self, robot, plan, start_s, seed=0):
        self.robot, self.plan, self.start_s = robot, plan, start_s
        self.random = np.random.default_rng(seed)
        self.steps = 0
        self.wanted = None

    def torque(self, time_s, x, dx, feet):
        """(12,) torques for the state measured now; called once every control step, in order."""
        plan, robot = self.plan, self.robot
        paths = self._paths(time_s)
        wanted = np.concatenate([robot.joints_for_foot(leg, paths[leg]) for leg in range(4)])
        before = wanted if self.wanted is None else self.wanted
        rates, self.wanted = (wanted - before) / CONTROL_STEP_S, wanted
        if self.steps % round(RANDOM_TORQUE_S / CONTROL_STEP_S) == 0:
            self.noise = plan.random_torque_nm * self.random.uniform(-1.0, 1.0, 12)
        self.steps += 1
        return plan.stiffness * (wanted - x[:12]) + plan.damping * (rates - dx[:12]) + self.noise

    def _paths(self, time_s):
        """(4, 3) wanted feet from their hips (m), trunk axes."""
        plan, robot = self.plan, self.robot
        ramp = np.clip((time_s - self.start_s) / RAMP_S, 0.0, 1.0)
        standing, progress = plan.gait.at(time_s - self.start_s)
        side = robot.hip_offset_m + plan.wider_m * np.sign(robot.hip_offset_m)
        arm = robot.hip_position_m[:, :2] + np.column_stack([np.zeros(4), side])
        turning = plan.yaw_rate * np.column_stack([-arm[:, 1], arm[:, 0]])
        step = ramp * plan.gait.stance_s * (np.array(plan.velocity) + turning)
        way = np.where(standing, 0.5 - progress, -0.5 * np.cos(np.pi * progress))
        if time_s < self.start_s:
            way = np.zeros(4)
        lift = np.where(standing, -plan.stance_push_m, plan.swing_height_m)
        paths = np.zeros((4, 3))
        paths[:, :2] = way[:, None] * step
        paths[:, 0] -= plan.behind_m
        paths[:, 1] += side
        paths[:, 2] = robot.foot_radius_m - plan.height_m
        paths[:, 2] += ramp * lift * np.sin(np.pi * progress)
        return paths
