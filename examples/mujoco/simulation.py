"""Physics at 0.5 ms, control and logging at 2 ms, and criteria of success.

`Simulation` accepts any controller: an
object with `torque(time_s, x, dx, feet) -> 12 torques (N m)`. State vectors are
those of the recordings: 12 joints, trunk position, roll-pitch-yaw (R = Rz Ry Rx),
and their rates (Euler-angle rates for the last three).
"""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from robot_model import PHYSICS_STEP_S

CONTROL_STEP_S = 0.002
CONTACT_THRESHOLD_N = 1.0


@dataclass
class SensorNoise:
    """Standard deviations of white noise on measurements (0: none)."""

    joint_rad: float = 0.0
    joint_rate: float = 0.0
    position_m: float = 0.0
    velocity: float = 0.0
    angle_rad: float = 0.0
    angle_rate: float = 0.0

    def spread(self):
        """(18,) for positions and (18,) for velocities."""
        position = [self.joint_rad] * 12 + [self.position_m] * 3 + [self.angle_rad] * 3
        rate = [self.joint_rate] * 12 + [self.velocity] * 3 + [self.angle_rate] * 3
        return np.array(position), np.array(rate)


@dataclass
class Push:
    """A force (N) and a moment (N m) on the trunk, world frame, between two times (s)."""

    start_s: float
    end_s: float
    force_n: tuple
    moment_nm: tuple = (0.0, 0.0, 0.0)

    def at(self, time_s):
        """(6,) force and moment at a time."""
        wrench = np.array([*self.force_n, *self.moment_nm])
        return wrench * (self.start_s <= time_s < self.end_s)


@dataclass
class Log:
    """One row per control step; `x`, `dx` as measured, torque as applied after clipping."""

    time_s: list = field(default_factory=list)
    x: list = field(default_factory=list)
    dx: list = field(default_factory=list)
    torque_nm: list = field(default_factory=list)
    foot_force_n: list = field(default_factory=list)
    foot_position_m: list = field(default_factory=list)
    other_contact: list = field(default_factory=list)

    def arrays(self):
        """The same log with numpy arrays for lists."""
        return Log(**{name: np.array(rows) for name, rows in vars(self).items()})

    def between(self, start_s, end_s):
        """The rows of a time span, with time, x and y counted from its first row."""
        rows = (self.time_s > start_s - 1e-9) & (self.time_s < end_s + 1e-9)
        cut = Log(**{name: values[rows].copy() for name, values in vars(self).items()})
        cut.time_s = np.arange(len(cut.time_s)) * CONTROL_STEP_S
        cut.foot_position_m[:, :, :2] -= cut.x[0, 12:14]
        cut.x[:, 12:14] -= cut.x[0, 12:14]
        return cut

    def before(self, row):
        """The rows before `row`."""
        return Log(**{name: values[:row] for name, values in vars(self).items()})

    def feet(self):
        """(rows, 4) contact flags: normal force above 1 N."""
        return self.foot_force_n[:, :, 2] > CONTACT_THRESHOLD_N


class Simulation:
    """One robot on the floor, stepped by torques."""

    def __init__(self, robot, noise=None, seed=0, push=None):
        self.robot = robot
        self.data = mujoco.MjData(robot.mj)
        self.push = push
        self.random = np.random.default_rng(seed)
        self.spread = noise.spread() if noise else None

    def reset(self, joints, height_m, rpy=(0.0, 0.0, 0.0)):
        """Places the robot at x = y = 0 and settles nothing: contact starts where it is put."""
        mujoco.mj_resetData(self.robot.mj, self.data)
        write_state(self.robot, self.data, np.concatenate([joints, [0, 0, height_m], rpy]))
        mujoco.mj_forward(self.robot.mj, self.data)

    def true_state(self):
        """Exact (x, dx), 18 each."""
        return read_state(self.robot, self.data)

    def measure(self):
        """(x, dx) with the sensors' noise."""
        x, dx = self.true_state()
        if self.spread is not None:
            x = x + self.spread[0] * self.random.standard_normal(18)
            dx = dx + self.spread[1] * self.random.standard_normal(18)
        return x, dx

    def foot_forces(self):
        """(4, 3) force of the floor on each foot (N, world), and whether anything else touches."""
        forces = np.zeros((4, 3))
        other = False
        wrench = np.zeros(6)
        for index in range(self.data.ncon):
            contact = self.data.contact[index]
            mujoco.mj_contactForce(self.robot.mj, self.data, index, wrench)
            geom = contact.geom2 if contact.geom1 == self.robot.floor_geom else contact.geom1
            sign = 1.0 if contact.geom1 == self.robot.floor_geom else -1.0
            leg = np.flatnonzero(self.robot.foot_geom == geom)
            if len(leg):
                forces[leg[0]] += sign * contact.frame.reshape(3, 3).T @ wrench[:3]
            elif wrench[0] > CONTACT_THRESHOLD_N:
                other = True
        return forces, other

    def run(self, controller, duration_s):
        """Runs a controller from now on; returns the log (a row before each control step)."""
        log = Log()
        feet = self.foot_forces()[0][:, 2] > CONTACT_THRESHOLD_N
        limit = self.robot.torque_limit_nm
        for _ in range(round(duration_s / CONTROL_STEP_S) + 1):
            time_s = self.data.time
            x, dx = self.measure()
            torque = np.clip(controller.torque(time_s, x, dx, feet), -limit, limit)
            self.data.ctrl[self.robot.actuator_index] = torque
            if self.push is not None:
                self.data.xfrc_applied[self.robot.trunk_body] = self.push.at(time_s)
            mujoco.mj_forward(self.robot.mj, self.data)
            forces, other = self.foot_forces()
            feet = forces[:, 2] > CONTACT_THRESHOLD_N
            log.time_s.append(time_s)
            log.x.append(x)
            log.dx.append(dx)
            log.torque_nm.append(torque)
            log.foot_force_n.append(forces)
            log.foot_position_m.append(self.data.geom_xpos[self.robot.foot_geom].copy())
            log.other_contact.append(other)
            for _ in range(round(CONTROL_STEP_S / PHYSICS_STEP_S)):
                mujoco.mj_step(self.robot.mj, self.data)
            acting = self.data.actuator_force[self.robot.actuator_index]
            if not np.array_equal(acting, torque):
                # The logged torque would not be the one that moved the robot.
                raise ValueError(f"the motors give {acting} N m, not the commanded {torque}")
        return log.arrays()


def read_state(robot, data):
    """(x, dx) of a MuJoCo state, 18 each."""
    rpy = rpy_from_quaternion(data.qpos[3:7])
    x = np.concatenate([data.qpos[robot.qpos_index], data.qpos[:3], rpy])
    rates = euler_rate_map(rpy) @ data.qvel[3:6]
    dx = np.concatenate([data.qvel[robot.dof_index], data.qvel[:3], rates])
    return x, dx


def write_state(robot, data, x, dx=None):
    """Puts (x, dx) into a MuJoCo state."""
    data.qpos[robot.qpos_index] = x[:12]
    data.qpos[:3] = x[12:15]
    data.qpos[3:7] = quaternion_from_rpy(x[15:])
    if dx is not None:
        data.qvel[robot.dof_index] = dx[:12]
        data.qvel[:3] = dx[12:15]
        data.qvel[3:6] = np.linalg.solve(euler_rate_map(x[15:]), dx[15:])


def rpy_from_quaternion(q):
    w, x, y, z = q
    return np.array(
        [
            np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0)),
            np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        ]
    )


def quaternion_from_rpy(rpy):
    (cr, cp, cy), (sr, sp, sy) = np.cos(np.array(rpy) / 2), np.sin(np.array(rpy) / 2)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def euler_rate_map(rpy):
    """3 x 3: angular velocity in the trunk frame -> (roll, pitch, yaw) rates."""
    sr, cr = np.sin(rpy[0]), np.cos(rpy[0])
    tp, cp = np.tan(rpy[1]), np.cos(rpy[1])
    return np.array([[1, sr * tp, cr * tp], [0, cr, -sr], [0, sr / cp, cr / cp]])
