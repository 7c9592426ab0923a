"""Differences between the jump as recorded and the robot that has to repeat it."""

import collections
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from robot_model import RobotModel
from simulation import CONTROL_STEP_S, Push, SensorNoise, Simulation, write_state


@dataclass(frozen=True)
class Perturbation:
    """One way in which robot, floor or sensors differ; the defaults change nothing.

    `short` heads its column of a table; `friction` is that of the floor.
    """

    name: str
    short: str
    payload_kg: float = 0.0
    friction: float | None = None
    torque_factor: float = 1.0
    push_n: tuple | None = None
    delay_s: float = 0.0
    damping_factor: float = 1.0
    start_offset_rad: float = 0.0
    noise: SensorNoise | None = None


NOMINAL = Perturbation("nominal", "nominal")
PERTURBATIONS = (
    Perturbation("payload +1 kg", "+1 kg", payload_kg=1.0),
    Perturbation("payload +2 kg", "+2 kg", payload_kg=2.0),
    Perturbation("friction 0.5", "mu 0.5", friction=0.5),
    Perturbation("torque x0.9", "tau 0.9", torque_factor=0.9),
    Perturbation("torque x1.1", "tau 1.1", torque_factor=1.1),
    Perturbation("push 25 N, 0.1 s", "push", push_n=(17.0, 17.0, -6.0)),
    Perturbation("delay 4 ms", "4 ms", delay_s=0.004),
    Perturbation("joint damping x2", "damping", damping_factor=2.0),
    Perturbation("start pose 0.04 rad", "start", start_offset_rad=0.04),
    Perturbation(
        "sensor noise",
        "noise",
        noise=SensorNoise(
            joint_rad=0.001,
            joint_rate=0.02,
            position_m=0.0005,
            velocity=0.005,
            angle_rad=0.001,
            angle_rate=0.01,
        ),
    ),
)
# A push begins so long before the feet leave the floor, and lasts so long.
PUSH_LEAD_S = 0.15
PUSH_S = 0.1
# Joints of all draws but the first start so far from the recording, where they start on it.
START_SCATTER_RAD = 0.01


def perturbed_simulation(name, perturbation, floor, x, dx, takeoff_s, draw=0):
    """A simulation of the named robot on a floor that starts from the state (x, dx), perturbed.

    The draw selects the random numbers: the offsets of the joints at the start and the sensors' noise;
    in all draws but the first also the heading of the push and a scatter of the start.
    """
    random = np.random.default_rng(draw)
    if perturbation.friction is not None:
        floor = replace(floor, friction=perturbation.friction)
    robot = RobotModel(name, floor)
    if perturbation.payload_kg:
        load_trunk(robot, perturbation.payload_kg)
    robot.mj.dof_damping[robot.dof_index] *= perturbation.damping_factor
    offset_rad = perturbation.start_offset_rad
    if draw > 0:
        offset_rad = max(offset_rad, START_SCATTER_RAD)
    x = x.copy()
    x[:12] += offset_rad * random.uniform(-1, 1, 12)
    push = None
    if perturbation.push_n is not None:
        turn = random.uniform(0, 2 * np.pi) if draw > 0 else 0.0
        start_s = takeoff_s - PUSH_LEAD_S
        push = Push(start_s, start_s + PUSH_S, turned(perturbation.push_n, turn))
    simulation = Simulation(robot, perturbation.noise, draw, push)
    mujoco.mj_resetData(robot.mj, simulation.data)
    write_state(robot, simulation.data, x, dx)
    mujoco.mj_forward(robot.mj, simulation.data)
    return simulation


def turned(force_n, angle_rad):
    """A force (N) turned about the vertical."""
    x, y, z = force_n
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return (c * x - s * y, s * x + c * y, z)


def load_trunk(robot, payload_kg):
    """Adds a mass that is spread over the trunk as the trunk's own."""
    trunk = robot.trunk_body
    factor = 1.0 + payload_kg / robot.mj.body_mass[trunk]
    robot.mj.body_mass[trunk] *= factor
    robot.mj.body_inertia[trunk] *= factor
    mujoco.mj_setConst(robot.mj, mujoco.MjData(robot.mj))


class Motors:
    """Changes of a controller's torques on their way to the joints: clipped to the limits,
    late by whole control steps (the first command acts until the second arrives), too strong or
    too weak by a factor."""

    def __init__(self, controller, perturbation, limit_nm):
        self.controller = controller
        self.factor = perturbation.torque_factor
        self.limit_nm = limit_nm
        self.delay = round(perturbation.delay_s / CONTROL_STEP_S)
        self.on_the_way = collections.deque()

    def torque(self, time_s, x, dx, feet):
        """Twelve torques (N m) as they act."""
        asked = self.controller.torque(time_s, x, dx, feet)
        self.on_the_way.append(np.clip(asked, -self.limit_nm, self.limit_nm))
        if len(self.on_the_way) > self.delay + 1:
            self.on_the_way.popleft()
        return self.factor * self.on_the_way[0]
