"""Plans walks at drawn speeds and yaw rates and drives a simulated Go1 along them.

Speeds are those along the heading of the robot, in the mean over the second half of a walk.
"""

import argparse
import pathlib
import subprocess
from dataclasses import dataclass, replace

import numpy as np

import walk_loop
from closed_loop import write_strip
from parallel import results_of
from path_axes import turned
from perturbations import NOMINAL

EXAMPLE = """example:
  cargo build --release
  MUJOCO_GL=egl python walk_plans.py --seed 1
plans 8 walks of 10 s at 0.2 to 0.9 m/s and up to 0.5 rad/s, and one 10 % faster than the fastest
recorded one, and drives each by the controller in C."""
RANGES = {"speed": (0.2, 0.9), "yaw rate": (-0.5, 0.5)}
# 10 % above the fastest recorded walk.
FASTEST = 0.94
AIM = 0.04
STRIDE_ROWS = 180  # of a plan's stride, 0.36 s
FOLLOWERS = ("MPC", "MPC, no recorded input", "no dynamics", "recorded torques + PD")


@dataclass(frozen=True)
class Reached:
    """A run along a plan: commanded and reached speed (m/s) and yaw rate (rad/s), and whether it fell."""

    follower: str
    commanded: tuple
    reached: tuple
    fell: bool

    def misses(self):
        """Largest error of speed and yaw rate, as a share of the command (of 0.2 where it is less)."""
        return miss(self.commanded, self.reached)


def miss(commanded, reached):
    """Largest error of speed and yaw rate, as a share of the command (of 0.2 where it is less)."""
    pairs = zip(commanded, reached, strict=True)
    return max(abs(got - asked) / max(abs(asked), 0.2) for asked, got in pairs)


def velocity_of(x):
    """Mean speed along the heading (m/s) and yaw rate (rad/s) over states (rows, 18), one each control step."""
    yaw = np.unwrap(x[:, 17])
    steps = np.diff(x[:, 12:14], axis=0)
    along = (steps * np.stack([np.cos(yaw[:-1]), np.sin(yaw[:-1])], axis=1)).sum()
    passed_s = (len(yaw) - 1) * walk_loop.CONTROL_STEP_S
    return float(along / passed_s), float((yaw[-1] - yaw[0]) / passed_s)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    root = walk_loop.ROOT
    parser.add_argument("--model", type=pathlib.Path, default=root / "models/go1-trot-d6.json")
    parser.add_argument("--romc", type=pathlib.Path, default=walk_loop.ROMC, help="the compiler")
    parser.add_argument("--out-dir", type=pathlib.Path, default=root / "out/walk_plans")
    parser.add_argument("--seed", type=int, default=1, help="of the commands")
    parser.add_argument("--walks", type=int, default=8, help="commands to draw")
    parser.add_argument("--followers", choices=FOLLOWERS, nargs="+", default=list(FOLLOWERS))
    parser.add_argument("--strip", type=pathlib.Path, help="picture of a stride of the first walk")
    parser.add_argument("--jobs", type=int, help="runs at a time (default: one per core)")
    arguments = parser.parse_args()
    arguments.out_dir.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(arguments.seed)
    drawn = [tuple(random.uniform(*span) for span in RANGES.values()) for _ in range(arguments.walks)]
    commands = [*drawn, (FASTEST, 0.0)]
    plans = [planned(arguments, number, command) for number, command in enumerate(commands)]
    controllers = walk_loop.built(arguments)
    tasks = [
        (follower, controllers, command, plan)
        for follower in arguments.followers
        for command, plan in zip(commands, plans, strict=True)
    ]
    print(table(results_of(run, tasks, arguments.jobs)))
    if arguments.strip:
        walk = walk_loop.read_walk(plans[0])
        log, _ = driven("MPC", controllers, plans[0])
        middle = len(walk.x) // 2
        place, yaw = walk.x[middle, 12:14], walk.x[middle, 17]
        states = [seen_from(place, yaw, x) for x in (walk.x, log.x)]
        strip = replace(walk, x=states[0])
        write_strip(arguments.strip, strip, states[1], middle, middle + STRIDE_ROWS)


def planned(arguments, number, command):
    """The recording that `romc plan` makes of a command."""
    path = arguments.out_dir / f"walk_{number}.csv.gz"
    speed, yaw_rate = command
    goal = ["--speed", f"{speed:.4f}", "--yaw-rate", f"{yaw_rate:.4f}", "--duration", "10"]
    plan = [arguments.romc, "plan", arguments.model, *goal, "--output", path, "--force"]
    subprocess.run([str(part) for part in plan], check=True, stdout=subprocess.DEVNULL)
    return path


def run(task):
    """One run; returns its speed and yaw rate and whether it fell."""
    follower, controllers, command, plan = task
    log, outcome = driven(follower, controllers, plan)
    reached = velocity_of(log.x[len(log.x) // 2 :])
    return Reached(follower, command, reached, outcome.fell)


def seen_from(place, yaw, x):
    """States (rows, 18) of a robot that would be at the origin and look along x at a place and heading."""
    x = x.copy()
    x[:, 12:14] = turned(x[:, 12:14] - place, np.full(len(x), -yaw))
    x[:, 17] -= yaw
    return x


def driven(follower, controllers, plan):
    """Log and Outcome of a follower along a plan."""
    settings = tuple(walk_loop.SETTINGS.items())
    return walk_loop.driven((follower, controllers, settings, NOMINAL, plan))


def table(runs):
    """Markdown: of each follower, walks without a fall, within the aim, and the largest error."""
    lines = ["| follower | walks | no fall | within 4 % | median error | largest error |", "|---" * 6 + "|"]
    for follower in dict.fromkeys(one.follower for one in runs):
        own = [one for one in runs if one.follower == follower]
        misses = [one.misses() for one in own]
        lines.append(
            f"| {follower} | {len(own)} | {sum(not one.fell for one in own)} "
            f"| {sum(miss <= AIM and not one.fell for miss, one in zip(misses, own, strict=True))} "
            f"| {100 * np.median(misses):.1f} % | {100 * max(misses):.1f} % |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
