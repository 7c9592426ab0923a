"""Which jumps each data set holds: ranges to draw plans from, splits and seeds."""

from dataclasses import dataclass, replace

import numpy as np

from asynchronous import AsynchronousController, AsynchronousPlan
from countermovement import CountermovementController, CountermovementPlan
from jump_controller import JumpController, JumpPlan
from robot_model import Floor
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
COUNTERMOVEMENT = {
    "stand_height_m": (0.290, 0.320),
    "dip_height_m": (0.205, 0.250),
    "dip_shift_m": (-0.010, 0.030),
    "dip_pitch_rad": (-0.06, 0.06),
    "dip_duration_s": (0.20, 0.28),
    "bottom_acceleration": (3.0, 7.0),
    "thrust_duration_s": (0.16, 0.20),
    "takeoff_height_m": (0.315, 0.335),
    "takeoff_pitch_rad": (-0.04, 0.04),
    "takeoff_yaw_rad": (-0.06, 0.06),
    "leg_stiffness": (2000.0, 3000.0),
    "leg_damping": (35.0, 60.0),
    "flight_stiffness": (22.0, 38.0),
    "flight_damping": (0.7, 1.1),
    "retraction_m": (0.0, 0.03),
    "landing_leg_m": (0.255, 0.280),
    "landing_reach_s": (0.07, 0.10),
    "landing_stiffness": (1200.0, 1900.0),
    "landing_damping": (45.0, 65.0),
    "landing_duration_s": (0.24, 0.36),
    "final_height_m": (0.270, 0.295),
}


@dataclass(frozen=True)
class FloorRange:
    """Ranges (lowest, highest) from which a `Floor` is drawn."""

    friction: tuple
    settling_s: tuple


@dataclass(frozen=True)
class JumpSet:
    """A data set: `splits` counts its jumps, `seed` fixes every draw in it.

    `base` is the plan that the draws complete; the velocities go into the field
    `velocity_field` of it. `to_touchdown` ends recordings before feet land. Every
    `push_every`-th jump is pushed. `distance_m` and `flight_s` are ranges
    that its recordings have to satisfy.
    """

    robot: str
    seed: int
    splits: tuple
    forward_velocity: tuple
    upward_velocity: tuple
    sideways_velocity: float
    ranges: dict
    base: JumpPlan | CountermovementPlan
    controller: type = JumpController
    velocity_field: str = "takeoff_velocity"
    to_touchdown: bool = False
    noise: SensorNoise | None = None
    start_noise_rad: float = 0.0
    push_n: float = 0.0
    push_moment_nm: float = 0.0
    push_every: int = 1
    push_after_s: tuple = (0.35, 0.55)
    floor: FloorRange | None = None
    distance_m: tuple = (0.14, 0.60)
    flight_s: tuple = (0.2, 0.5)


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
    "go1-other": JumpSet(
        robot="go1",
        seed=2031,
        splits=(("jump", 8),),
        forward_velocity=(0.27, 1.10),
        upward_velocity=(1.48, 1.80),
        sideways_velocity=0.06,
        ranges=COUNTERMOVEMENT,
        base=CountermovementPlan(),
        controller=CountermovementController,
        push_n=18.0,
        push_moment_nm=2.5,
        push_every=3,
        push_after_s=(0.15, 0.35),
        floor=FloorRange(friction=(0.55, 0.75), settling_s=(0.025, 0.045)),
        distance_m=(0.12, 0.41),
        flight_s=(0.2, 0.32),
    ),
}


@dataclass(frozen=True)
class Jump:
    """One jump to record: its file's stem, plan, seed, disturbances and floor."""

    stem: str
    plan: JumpPlan | CountermovementPlan
    seed: int
    start_offset_rad: np.ndarray
    push: Push | None
    floor: Floor = Floor()


def jumps_of(jump_set):
    """The jumps of a set. Forward velocities are spread evenly, then shuffled over the splits,
    so that every split spans the range; all else is drawn independently."""
    random = np.random.default_rng(jump_set.seed)
    stems = [f"{split}_{k + 1:02d}" for split, count in jump_set.splits for k in range(count)]
    low, high = jump_set.forward_velocity
    forward = np.empty(len(stems))
    slots = np.linspace(low, high, len(stems))
    order = interleaved([count for _, count in jump_set.splits], random)
    for rank, index in enumerate(order):
        forward[index] = slots[rank]
    jumps = []
    for number, (stem, vx) in enumerate(zip(stems, forward, strict=True), start=1):
        vz = random.uniform(*jump_set.upward_velocity)
        vy = random.uniform(-jump_set.sideways_velocity, jump_set.sideways_velocity)
        drawn = {name: random.uniform(*span) for name, span in jump_set.ranges.items()}
        plan = replace(jump_set.base, **{jump_set.velocity_field: (vx, vy, vz)}, **drawn)
        seed = int(random.integers(2**31))
        offset = jump_set.start_noise_rad * random.uniform(-1, 1, 12)
        push = _push(jump_set, random) if number % jump_set.push_every == 0 else None
        jumps.append(Jump(stem, plan, seed, offset, push, drawn_floor(jump_set.floor, random)))
    return jumps


def recorded_floor(folder, stem):
    """The floor on which a jump was recorded; the usual one for recordings of no set."""
    jumps = jumps_of(SETS[folder]) if folder in SETS else []
    return next((jump.floor for jump in jumps if jump.stem == stem), Floor())


def interleaved(counts, random):
    """Indices of all splits, ordered so that each split's members are spread over the ranks."""
    place = []
    index = 0
    for count in counts:
        for k in range(count):
            place.append(((k + 0.5 + random.uniform(-0.3, 0.3)) / count, index))
            index += 1
    return [index for _, index in sorted(place)]


def _push(jump_set, random):
    """A push in a direction of its own, at some time of crouch or thrust."""
    size_n = jump_set.push_n
    if size_n == 0:
        return None
    start = WARMUP_S + random.uniform(*jump_set.push_after_s)
    angle = random.uniform(0, 2 * np.pi)
    force = size_n * np.array([np.cos(angle), np.sin(angle), random.uniform(-0.5, 0.5)])
    if jump_set.push_moment_nm == 0.0:
        return Push(start, start + 0.1, tuple(force))
    moment = (0.0, 0.0, jump_set.push_moment_nm * random.uniform(-1, 1))
    return Push(start, start + 0.1, tuple(force), moment)


def drawn_floor(span, random):
    if span is None:
        return Floor()
    return Floor(random.uniform(*span.friction), random.uniform(*span.settling_s))
