"""Figures of a recorded walk and the faults that refuse it, from recorded columns alone."""

from dataclasses import dataclass

import mujoco
import numpy as np

from robot_model import PHYSICS_STEP_S
from simulation import CONTROL_STEP_S, read_state, write_state

MAX_TILT_RAD = 0.15
SPEED_TOLERANCE, SPEED_SLACK = 0.1, 0.05
# Speeds are means over whole strides from here on.
STEADY_S = 1.0
# Largest differences after a step that is repeated: m or rad, and per s.
STEP_TOLERANCE = {"position": 5e-5, "velocity of the body": 1e-3, "velocity of a joint": 1e-2}
REPEATED_EVERY = 5


@dataclass(frozen=True)
class GaitAssessment:
    """Figures of one walk (m, s, rad): velocity along and across the heading and yaw rate over
    whole strides, trunk height, shares of the time without and with all feet on the floor."""

    duration_s: float
    velocity: tuple
    yaw_rate: float
    mean_height_m: float
    height_range_m: float
    largest_tilt_rad: float
    flight_share: float
    all_feet_share: float
    torque_share: float

    def faults(self, walk, tracks):
        """Deviations from the commanded walk beyond the limits; empty if there are none."""
        faults = []
        if self.largest_tilt_rad > MAX_TILT_RAD:
            faults.append(f"roll or pitch reaches {self.largest_tilt_rad:.2f} rad")
        if self.height_range_m > walk.range.height_range_m:
            faults.append(f"the trunk's height varies by {self.height_range_m:.3f} m")
        if self.torque_share > 1.0:
            faults.append(f"torque reaches {100 * self.torque_share:.1f} % of its limit")
        off = abs(self.velocity[0] - walk.plan.velocity[0])
        if tracks and off > SPEED_TOLERANCE * walk.plan.velocity[0] + SPEED_SLACK:
            faults.append(f"achieves {self.velocity[0]:.2f} of {walk.plan.velocity[0]:.2f} m/s")
        return faults


def assess_walk(robot, walk, time_s, x, dx, torque_nm, feet):
    """Figures of a recorded walk."""
    frequency = walk.plan.gait.frequency_hz
    strides = np.floor((time_s[-1] - STEADY_S) * frequency)
    first = len(time_s) - 1 - round(strides / frequency / CONTROL_STEP_S)
    yaw, (vx, vy) = x[first:, 17], dx[first:, 12:14].T
    along = np.cos(yaw) * vx + np.sin(yaw) * vy
    across = np.cos(yaw) * vy - np.sin(yaw) * vx
    return GaitAssessment(
        duration_s=float(time_s[-1]),
        velocity=(float(along.mean()), float(across.mean())),
        yaw_rate=float(dx[first:, 17].mean()),
        mean_height_m=float(x[first:, 14].mean()),
        height_range_m=float(np.ptp(x[first:, 14])),
        largest_tilt_rad=float(np.abs(x[:, 15:17]).max()),
        flight_share=float((~feet[first:].any(axis=1)).mean()),
        all_feet_share=float(feet[first:].all(axis=1).mean()),
        torque_share=float((np.abs(torque_nm) / robot.torque_limit_nm).max()),
    )


def walk_table(rows):
    """Markdown table of (Walk, GaitAssessment) pairs."""
    lines = [
        "| walk | from | gait Hz, duty | commanded along, across m/s, yaw rad/s "
        "| achieved | height m | height range m | tilt rad | flight | all feet | torque |",
        "|---" * 11 + "|",
    ]
    for walk, a in rows:
        plan = walk.plan
        start = "standing" if walk.recorded_s < 0.0 else "walking"
        commanded = _speeds(plan.velocity, plan.yaw_rate)
        lines.append(
            f"| {walk.stem} | {start} | {plan.gait.frequency_hz:.2f}, {plan.gait.duty:.2f} "
            f"| {commanded} | {_speeds(a.velocity, a.yaw_rate)} | {a.mean_height_m:.3f} "
            f"| {a.height_range_m:.3f} | {a.largest_tilt_rad:.3f} | {100 * a.flight_share:.0f} % "
            f"| {100 * a.all_feet_share:.0f} % | {100 * a.torque_share:.0f} % |"
        )
    return "\n".join(lines)


def _speeds(velocity, yaw_rate):
    """Text of a velocity and a yaw rate, without negative zeros."""
    return ", ".join(f"{round(v, 2) + 0.0:.2f}" for v in (*velocity, yaw_rate))


def step_faults(robot, x, dx, torque_nm):
    """Faults of steps that MuJoCo does not repeat from the recorded states and torques."""
    worst = step_differences(robot, x, dx, torque_nm)
    return [
        f"a repeated step leaves a {name} {value:.2e} away"
        for (name, limit), value in zip(STEP_TOLERANCE.items(), worst, strict=True)
        if value > limit
    ]


def step_differences(robot, x, dx, torque_nm):
    """Largest differences after single steps from recorded states, as in `STEP_TOLERANCE`."""
    data = mujoco.MjData(robot.mj)
    worst = np.zeros(3)
    for row in range(0, len(x) - 1, REPEATED_EVERY):
        mujoco.mj_resetData(robot.mj, data)
        write_state(robot, data, x[row], dx[row])
        data.ctrl[robot.actuator_index] = torque_nm[row]
        for _ in range(round(CONTROL_STEP_S / PHYSICS_STEP_S)):
            mujoco.mj_step(robot.mj, data)
        position, velocity = read_state(robot, data)
        position, velocity = np.abs(position - x[row + 1]), np.abs(velocity - dx[row + 1])
        found = (position.max(), velocity[12:].max(), velocity[:12].max())
        worst = np.maximum(worst, found)
    return worst
