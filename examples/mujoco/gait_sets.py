"""The data sets of walks: ranges to draw plans from, splits and seeds."""

from dataclasses import dataclass, field, replace

import numpy as np

from gait_clock import Gait
from gait_controller import RAMP_S, GaitController, GaitPlan
from jump_sets import FloorRange, drawn_floor, interleaved
from position_trot import PositionPlan, PositionTrot
from robot_model import Floor
from simulation import CONTROL_STEP_S

# The robot stands this long before the first step; recordings from standing begin in between.
STANDING_S, RECORDED_STANDING_S = 0.4, 0.2
# Other recordings begin this long after the first step, and up to a stride later.
SETTLING_S = 1.2

# Plan field -> (lowest, highest) of the uniform draw.
BY_WRENCH = {"height_m": (0.26, 0.29), "swing_height_m": (0.045, 0.075)}
LOW_SWING = {"height_m": (0.26, 0.28), "swing_height_m": (0.02, 0.04)}
BY_POSITIONS = {
    "height_m": (0.290, 0.315),
    "swing_height_m": (0.045, 0.065),
    "stiffness": (80.0, 120.0),
    "damping": (2.0, 3.0),
    "stance_push_m": (0.004, 0.020),
    "behind_m": (0.005, 0.030),
    "wider_m": (0.0, 0.02),
}


@dataclass(frozen=True)
class GaitRange:
    """Walks of one gait: splits, ranges of the draws, and a limit of the recordings.

    Speeds (m/s) are spread evenly over the walks; duties are drawn from one span each, in turn.
    Every second walk turns (up to `yaw_rate`, rad/s) or goes sideways (up to `sideways`, m/s). With
    `standing`, one of five is recorded from standing.
    """

    gait: str
    splits: tuple
    speed: tuple
    frequency_hz: tuple
    duties: tuple
    base: GaitPlan | PositionPlan
    controller: type
    ranges: dict
    yaw_rate: float = 0.0
    sideways: float = 0.0
    standing: bool = False
    height_range_m: float = 0.03


@dataclass(frozen=True)
class GaitSet:
    """A data set. `tracks`: the commanded speed has to be reached. `refused`: number of refused
    draws before the recorded one, by the walk's stem."""

    seed: int
    gaits: tuple
    robot: str = "go1"
    floor: FloorRange | None = None
    tracks: bool = True
    refused: dict = field(default_factory=dict)


TROT = GaitRange(
    gait="trot",
    splits=(("train", 12), ("validation", 3), ("test", 3)),
    speed=(0.0, 0.87),
    frequency_hz=(2.2, 3.2),
    duties=((0.37, 0.39), (0.47, 0.49), (0.57, 0.61)),
    base=GaitPlan(),
    controller=GaitController,
    ranges=BY_WRENCH,
    yaw_rate=0.7,
    sideways=0.2,
    standing=True,
)
CRAWL = replace(
    TROT,
    gait="crawl",
    splits=(("crawl", 3),),
    speed=(0.06, 0.16),
    frequency_hz=(1.0, 1.4),
    duties=((0.86, 0.88),),
    yaw_rate=0.1,
    sideways=0.0,
    standing=False,
)
PRONK = replace(
    TROT,
    gait="pronk",
    splits=(("pronk", 3),),
    speed=(0.0, 0.4),
    frequency_hz=(2.3, 2.9),
    duties=((0.70, 0.72),),
    ranges=LOW_SWING,
    yaw_rate=0.0,
    sideways=0.0,
    standing=False,
    height_range_m=0.11,
)
# Feet that only follow positions lag: the commanded speed is higher than the achieved one.
OTHER_TROT = replace(
    TROT,
    splits=(("trot", 6),),
    speed=(0.08, 0.68),
    frequency_hz=(2.3, 3.1),
    duties=((0.42, 0.46), (0.48, 0.54)),
    base=PositionPlan(),
    controller=PositionTrot,
    ranges=BY_POSITIONS,
    yaw_rate=0.6,
    sideways=0.12,
)

GAIT_SETS = {
    "go1-trot": GaitSet(seed=2041, gaits=(TROT,)),
    "go1-trot-other": GaitSet(
        seed=2043,
        gaits=(OTHER_TROT,),
        floor=FloorRange(friction=(0.55, 0.75), settling_s=(0.025, 0.045)),
        tracks=False,
    ),
    "go1-gaits": GaitSet(seed=2047, gaits=(CRAWL, PRONK)),
}


@dataclass(frozen=True)
class Walk:
    """One walk to record: its file's stem, ranges, plan, seed and floor. The recording begins
    `recorded_s` after the first step (before it if negative)."""

    stem: str
    range: GaitRange
    plan: GaitPlan | PositionPlan
    seed: int
    floor: Floor
    recorded_s: float

    def start_yaw(self):
        """Yaw (rad) to start with, so that the recording begins near 0."""
        return -self.plan.yaw_rate * max(self.recorded_s - 0.5 * RAMP_S, 0.0)


def walks_of(gait_set):
    """The walks of a set, as recorded."""
    return [
        drawn_walk(gait_set, index, gait_set.refused.get(stem, 0))
        for index, stem in enumerate(stems_of(gait_set))
    ]


def stems_of(gait_set):
    """Names of a set's recordings."""
    splits = [split for span in gait_set.gaits for split in span.splits]
    return [f"{split}_{k + 1:02d}" for split, count in splits for k in range(count)]


def drawn_walk(gait_set, index, refused):
    """A walk of the set after this many refused draws. Speed, kind of bend and start follow from
    its place in the set; all else is drawn anew."""
    number = index
    for span in gait_set.gaits:
        counts = [count for _, count in span.splits]
        if number < sum(counts):
            break
        number -= sum(counts)
    order = interleaved(counts, np.random.default_rng([gait_set.seed, index - number]))
    random = np.random.default_rng([gait_set.seed, index, refused])
    low, high = span.speed
    forward = low + (high - low) * order.index(number) / (len(order) - 1)
    # Of four walks the second turns and the last goes sideways, the next four to the other side.
    bend = random.uniform(0.3, 1.0) * (1.0 if number % 8 < 4 else -1.0) * (number % 2)
    aside = number % 4 == 3 and span.sideways > 0.0
    yaw_rate, sideways = (0.0, span.sideways * bend) if aside else (span.yaw_rate * bend, 0.0)
    duty = random.uniform(*span.duties[number % len(span.duties)])
    gait = Gait(span.gait, random.uniform(*span.frequency_hz), duty)
    drawn = {name: random.uniform(*limits) for name, limits in span.ranges.items()}
    plan = replace(span.base, gait=gait, velocity=(forward, sideways), yaw_rate=yaw_rate, **drawn)
    steps = round((SETTLING_S + random.uniform() / gait.frequency_hz) / CONTROL_STEP_S)
    standing = span.standing and number % 5 == 1
    recorded_s = -RECORDED_STANDING_S if standing else steps * CONTROL_STEP_S
    seed = int(random.integers(2**31))
    floor = drawn_floor(gait_set.floor, random)
    stem = stems_of(gait_set)[index]
    return Walk(stem, span, plan, seed, floor, recorded_s)
