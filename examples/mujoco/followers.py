"""Controllers that follow a recorded jump: the latent MPC, and its baselines.

All of them end in joint torques at 500 Hz. `Follower` is their common base: a
feed-forward torque that is held for 10 ms and a joint PD of low gain towards a
posture. In flight the feed-forward torque is left out, the PD alone acts.
"""

from dataclasses import dataclass

import numpy as np

from robot_model import Floor
from simulation import CONTROL_STEP_S

POSITION_GAIN = 20.0
VELOCITY_GAIN = 0.8
MPC_STEP_S = 0.01
FIRST_SUPERVISED = 20


@dataclass(frozen=True)
class Jump:
    """A recorded jump: (rows,) times in s, (rows, 18) states and rates, (rows, 12) torques in N m,
    (rows, 4) feet; the folder of its recording and the floor that it was made on."""

    name: str
    time_s: np.ndarray
    x: np.ndarray
    dx: np.ndarray
    torque_nm: np.ndarray
    feet: np.ndarray
    folder: str = ""
    floor: Floor = Floor()

    def row_at(self, time_s):
        """Row of the last sample at or before a time."""
        row = int((time_s - self.time_s[0]) / CONTROL_STEP_S + 1e-6)
        return min(max(row, 0), len(self.time_s) - 1)


class Follower:
    """Feed-forward torque plus joint PD; `plan` is asked every `step_s` for both."""

    feed_forward_in_flight = False
    step_s = MPC_STEP_S

    def __init__(self):
        self.next_s = 0.0

    def torque(self, time_s, x, dx, feet):
        """Twelve torques (N m) for a measurement."""
        if time_s > self.next_s - 1e-6:
            self.feed_forward_nm, self.joints, self.rates = self.plan(time_s, x, dx, feet)
            self.next_s += self.step_s
        torque = POSITION_GAIN * (self.joints - x[:12]) + VELOCITY_GAIN * (self.rates - dx[:12])
        if feet.any() or self.feed_forward_in_flight:
            torque = torque + self.feed_forward_nm
        return torque

    def plan(self, time_s, x, dx, feet):
        """(torques N m, joint positions rad, joint rates rad/s) for the next 10 ms."""
        raise NotImplementedError


class LatentMpc(Follower):
    """The latent controller."""

    def __init__(self, controller):
        super().__init__()
        self.controller = controller
        self.statuses = {}
        self.solve_us = []

    def plan(self, time_s, x, dx, feet):
        command = self.controller.step(time_s, x, dx, feet)
        self.statuses[command.status] = self.statuses.get(command.status, 0) + 1
        self.solve_us.append(command.solve_us)
        return (
            np.array(command.torque),
            np.array(command.joint_position),
            np.array(command.joint_velocity),
        )


class WithoutFeedback(LatentMpc):
    """The same controller without feedback: at every step it gets the recorded state as the measurement."""

    def __init__(self, controller, jump):
        super().__init__(controller)
        self.jump = jump

    def plan(self, time_s, x, dx, feet):
        row = self.jump.row_at(time_s)
        jump = self.jump
        return super().plan(time_s, jump.x[row], jump.dx[row], jump.feet[row])


class Replay(Follower):
    """The recorded posture, its feed-forward the recorded torques or none (PD alone)."""

    def __init__(self, jump, with_torques):
        super().__init__()
        self.jump = jump
        self.with_torques = with_torques

    def plan(self, time_s, x, dx, feet):
        now = self.jump.row_at(time_s)
        held = slice(now, self.jump.row_at(time_s + MPC_STEP_S - CONTROL_STEP_S) + 1)
        then = self.jump.row_at(time_s + MPC_STEP_S)
        torque_nm = self.jump.torque_nm[held].mean(axis=0) if self.with_torques else np.zeros(12)
        return torque_nm, self.jump.x[then, :12], self.jump.dx[then, :12]


class TorquesOnly:
    """The recorded torques, sample by sample, and nothing else."""

    def __init__(self, jump):
        self.jump = jump

    def torque(self, time_s, x, dx, feet):
        """Twelve torques (N m) for a time."""
        return self.jump.torque_nm[self.jump.row_at(time_s)]


class Commanded:
    """The controller in C: torques of its command, and a joint PD with the command's gains, which the
    supervisor fades."""

    def __init__(self, controller, rate_hz):
        self.controller = controller
        self.every = round(1 / (rate_hz * CONTROL_STEP_S))
        self.steps, self.command = 0, None
        self.statuses = {}

    def torque(self, time_s, x, dx, feet):
        """Twelve torques (N m) for a measurement."""
        if self.steps % self.every == 0:
            self.step(time_s, x, dx, feet)
        self.steps += 1
        command = self.command
        joints, rates = np.array(command.joint_position), np.array(command.joint_velocity)
        return (
            np.array(command.torque)
            + command.stiffness * (joints - x[:12])
            + command.damping * (rates - dx[:12])
        )

    def step(self, time_s, x, dx, feet):
        """A new command for a measurement."""
        self.command = self.controller.step(time_s, x, dx, feet)
        self.statuses[self.command.status] = self.statuses.get(self.command.status, 0) + 1
