"""Which jumps each data set holds: ranges to draw plans from, splits and seeds."""

from dataclasses import dataclass, replace

import numpy as np

from asynchronous import AsynchronousController, AsynchronousPlan
from jump_controller import JumpController, JumpPlan
from simulation import Push, SensorNoise

# The robot stands this long, unrecorded, before each recording starts.
WARMUP_S = 0.3

# Plan field -> (lowest, highest) of the uniform draw.
SYNCHRONOUS = {
    "stand_height_m": (0.262, 0.285),
    "crouch_height_m": (0.172, 0.198),
    "crouch_shift_m": (-0.035, 0.010),
    "takeoff_height_m": (0.310, 0.330),
    "takeoff_pitch_rate": (-0.25, 0.25),
    "crouch_duration_s": (0.30, 0.42),
    "hold_s": (0.02, 0.06),
    "tuck_m": (0.02, 0.05),
    "landing_leg_m": (0.275, 0.295),
    "landing_reach_s": (0.075, 0.105),
    "landing_duration_s": (0.34, 0.44),
    "final_height_m": (0.250, 0.272),
    "roll_rad": (-0.02, 0.02),
    "yaw_rad": (-0.02, 0.02),
}
ASYNCHRONOUS = {
    "stand_height_m": (0.262, 0.285),
    "crouch_height_m": (0.180, 0.196),
    "crouch_shift_m": (-0.085, -0.060),
    "front_duration_s": (0.160, 0.180),
    "front_pitch_rate": (-3.5, -2.9),
    "rear_duration_s": (0.172, 0.192),
    "rear_acceleration": (1.0, 2.2),
    "takeoff_pitch_rad": (-0.22, -0.16),
    "takeoff_pitch_rate": (-2.0, -0.5),
    "crouch_duration_s": (0.30, 0.42),
    "hold_s": (0.02, 0.06),
    "front_tuck_m": (0.05, 0.08),
    "landing_leg_m": (0.275, 0.290),
    "landing_reach_s": (0.11, 0.12),
    "roll_rad": (-0.02, 0.02),
    "yaw_rad": (-0.02, 0.02),
}


@dataclass(frozen=True)
class JumpSet:
    """A data set: `splits` counts its jumps, `seed` fixes every draw in it.

    `base` is the plan that the draws complete; the velocities go into the field
    `velocity_field` of it. `to_touchdown` ends recordings before feet land.
    """

    robot: str
    seed: int
    splits: tuple
    forward_velocity: tuple
    upward_velocity: tuple
    sideways_velocity: float
    ranges: dict
    base: JumpPlan
    controller: type = JumpController
    velocity_field: str = "takeoff_velocity"
    to_touchdown: bool = False
    noise: SensorNoise | None = None
    start_noise_rad: float = 0.0
    push_n: float = 0.0


SETS = {
    "go1": JumpSet(
        robot="go1",
        seed=2024,
        splits=(("train", 14), ("validation", 3), ("test", 3)),
        forward_velocity=(0.42, 1.05),
        upward_velocity=(1.32, 1.60),
        sideways_velocity=0.04,
        ranges=SYNCHRONOUS,
        base=JumpPlan(),
    ),
    "go1-noisy": JumpSet(
        robot="go1",
        seed=2027,
        splits=(("train", 4), ("test", 1)),
        forward_velocity=(0.45, 1.00),
        upward_velocity=(1.42, 1.60),
        sideways_velocity=0.04,
        ranges=SYNCHRONOUS,
        base=JumpPlan(),
        noise=SensorNoise(
            joint_rad=0.001,
            joint_rate=0.02,
            position_m=0.0005,
            velocity=0.005,
            angle_rad=0.001,
            angle_rate=0.01,
        ),
        start_noise_rad=0.04,
        push_n=25.0,
    ),
    "go2-asynchronous": JumpSet(
        robot="go2",
        seed=2026,
        splits=(("train", 6), ("validation", 2), ("test", 2)),
        forward_velocity=(-0.10, 0.20),
        upward_velocity=(0.74, 0.82),
        sideways_velocity=0.03,
        ranges=ASYNCHRONOUS,
        base=AsynchronousPlan(),
        controller=AsynchronousController,
        velocity_field="front_velocity",
        to_touchdown=True,
    ),
}


@dataclass(frozen=True)
class Jump:
    """One jump to record: its file's stem, plan, seed and disturbances."""

    stem: str
    plan: JumpPlan
    seed: int
    start_offset_rad: np.ndarray
    push: Push | None


def jumps_of(jump_set):
    """The jumps of a set. Forward velocities are spread evenly, then shuffled over the splits,
    so that every split spans the range; all else is drawn independently."""
    random = np.random.default_rng(jump_set.seed)
    stems = [f"{split}_{k + 1:02d}" for split, count in jump_set.splits for k in range(count)]
    low, high = jump_set.forward_velocity
    forward = np.empty(len(stems))
    slots = np.linspace(low, high, len(stems))
    order = _interleaved([count for _, count in jump_set.splits], random)
    for rank, index in enumerate(order):
        forward[index] = slots[rank]
    jumps = []
    for stem, vx in zip(stems, forward, strict=True):
        vz = random.uniform(*jump_set.upward_velocity)
        vy = random.uniform(-jump_set.sideways_velocity, jump_set.sideways_velocity)
        drawn = {name: random.uniform(*span) for name, span in jump_set.ranges.items()}
        plan = replace(jump_set.base, **{jump_set.velocity_field: (vx, vy, vz)}, **drawn)
        seed = int(random.integers(2**31))
        offset = jump_set.start_noise_rad * random.uniform(-1, 1, 12)
        jumps.append(Jump(stem, plan, seed, offset, _push(jump_set.push_n, random)))
    return jumps


def _interleaved(counts, random):
    """Indices of all splits, ordered so that each split's members are spread over the ranks."""
    place = []
    index = 0
    for count in counts:
        for k in range(count):
            place.append(((k + 0.5 + random.uniform(-0.3, 0.3)) / count, index))
            index += 1
    return [index for _, index in sorted(place)]


def _push(size_n, random):
    if size_n == 0:
        return None
    start = WARMUP_S + random.uniform(0.35, 0.55)
    angle = random.uniform(0, 2 * np.pi)
    force = size_n * np.array([np.cos(angle), np.sin(angle), random.uniform(-0.5, 0.5)])
    return Push(start, start + 0.1, tuple(force))
