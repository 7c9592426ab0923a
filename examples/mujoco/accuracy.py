"""How exact position and velocity must be: planned jumps of a simulated Go1 by the controller in C on wrong estimates.

Every run follows a plan of plan_jumps.py from the first measurement on with one fault of the estimate.
"""

import argparse
import collections
import csv
import pathlib
from dataclasses import asdict, dataclass

import numpy as np

import c_controller
from assessment import repetition_faults
from closed_loop import named_number, read_jump
from followers import Commanded, Jump, Replay
from model_inputs import ModelInputs
from parallel import results_of
from perturbations import NOMINAL, perturbed_simulation
from plan_jumps import (
    ROBOT,
    ROMC,
    ROOT,
    drawn_goals,
    figures_of,
    made_controller,
    planned,
    settings_of,
    start_of,
    target_of,
)
from primitives import Goal
from robot_model import Floor
from simulation import CONTROL_STEP_S

EXAMPLE = """example:
  cargo build --release
  python accuracy.py --seed 1 --out-dir ../../out/accuracy
plans the 18 goals that plan_jumps.py draws from the seed, and jumps each with every fault and size.
Prints one row per fault and size, means with the largest in brackets: errors of landing and apex
against the goal, how far the landing moved from that on exact measurements, the error of pitch where
the plan touches down, and the fallbacks and faults that the controller reported, with the number of
runs. Writes them to accuracy.csv, the printed tables to table.md, and one row per run to runs.csv."""
FIRST_FALLBACK = 10
HARMLESS_CM = 1.0
QUICK_GOALS = ("in00", "in01", "out00")
DEGREE = np.pi / 180


@dataclass(frozen=True)
class Fault:
    """A fault of the estimate: its kind, the coordinates of `x` or `dx`, its sizes, and one of them in SI."""

    name: str
    kind: str  # noise: white, a new one for each measurement; bias: of either sign; delay
    of: str = ""
    coordinates: tuple = ()
    sizes: tuple = ()
    unit: str = ""
    si: float = 1.0


JOINTS, BASE, HEIGHT, PITCH = tuple(range(12)), (12, 13, 14), (14,), (16,)
FAULTS = (
    Fault("noise of height", "noise", "x", HEIGHT, (2, 5, 10), "mm", 1e-3),
    Fault("noise of velocity", "noise", "dx", BASE, (0.01, 0.02, 0.05, 0.2, 0.4), "m/s"),
    Fault("noise of pitch", "noise", "x", PITCH, (0.5, 1, 2, 5), "deg", DEGREE),
    Fault("noise of pitch rate", "noise", "dx", PITCH, (0.2, 0.5, 1, 5, 50), "deg/s", DEGREE),
    Fault("noise of joint angles", "noise", "x", JOINTS, (0.5, 1, 5), "deg", DEGREE),
    Fault("noise of joint rates", "noise", "dx", JOINTS, (2, 5, 10, 50), "deg/s", DEGREE),
    Fault("delay", "delay", sizes=(2, 4, 10, 20), unit="ms", si=1e-3),
    Fault("bias of height", "bias", "x", HEIGHT, (0.2, 0.5, 1, 2, 5), "cm", 1e-2),
    Fault("bias of forward velocity", "bias", "dx", (12,), (0.02, 0.05, 0.1, 0.2), "m/s"),
    Fault("bias of upward velocity", "bias", "dx", (14,), (0.02, 0.05, 0.1, 0.2), "m/s"),
    Fault("bias of pitch", "bias", "x", PITCH, (1, 2, 5), "deg", DEGREE),
    Fault("bias of pitch rate", "bias", "dx", PITCH, (2, 5, 10), "deg/s", DEGREE),
)
EXACT = Fault("exact measurements", "exact", sizes=(0,))
REPLAYS = {
    Fault("no feedback: torques of the plan, joint PD", "replay", sizes=(0,)): True,
    Fault("no feedback: joint PD alone", "replay", sizes=(0,)): False,
}


@dataclass(frozen=True)
class Planned:
    """A goal, its plan with the model's input, and the controller's settings for it."""

    goal: Goal
    jump: Jump
    u: np.ndarray
    settings: dict


@dataclass
class Outcome:
    """One run: which fault of which signed size, and how the jump ended."""

    fault: str
    size: float
    unit: str
    goal: str
    success: bool
    faults: str
    distance_m: float
    distance_error_m: float
    apex_error_m: float
    pitch_error_deg: float  # where the plan touches down
    statuses: str  # fallbacks and faults that the controller reported


class Estimated(Commanded):
    """The controller with its joint PD, on an estimate with one fault of a signed size in SI."""

    def __init__(self, controller, rate_hz, fault, size, seed):
        super().__init__(controller, rate_hz)
        self.random = np.random.default_rng(seed)
        self.noise, self.bias = ({"x": np.zeros(18), "dx": np.zeros(18)} for _ in range(2))
        if fault.of:
            {"noise": self.noise, "bias": self.bias}[fault.kind][fault.of][list(fault.coordinates)] = size
        self.delay = round(size / CONTROL_STEP_S) if fault.kind == "delay" else 0
        self.on_the_way = collections.deque()

    def torque(self, time_s, x, dx, feet):
        """Twelve torques (N m); the encoders of the joint PD are those of the estimate, without its delay."""
        x = x + self.bias["x"] + self.noise["x"] * self.random.standard_normal(18)
        dx = dx + self.bias["dx"] + self.noise["dx"] * self.random.standard_normal(18)
        if not self.on_the_way:
            # Before the jump the robot moved as it does at its start.
            for late in range(self.delay, 0, -1):
                self.on_the_way.append((x - late * CONTROL_STEP_S * dx, dx, feet))
        self.on_the_way.append((x, dx, feet))
        self.arrived = self.on_the_way.popleft()
        return super().torque(time_s, x, dx, feet)

    def step(self, time_s, x, dx, feet):
        super().step(time_s, *self.arrived)


def main():
    arguments = parse_arguments()
    arguments.out_dir.mkdir(parents=True, exist_ok=True)
    planned_jumps = list(plans(arguments))
    build = arguments.out_dir / "controller"
    crate = c_controller.build(arguments.model, build, arguments.romc)
    tasks = [
        (arguments, crate, fault, size, plan)
        for fault in (EXACT, *REPLAYS, *FAULTS)
        for size in signed_sizes(fault, arguments.quick)
        for plan in planned_jumps
    ]
    outcomes = results_of(run, tasks, arguments.jobs)
    rows = table(outcomes)
    text = markdown(rows)
    print(text)
    write_rows(arguments.out_dir / "accuracy.csv", rows)
    write_rows(arguments.out_dir / "runs.csv", [asdict(outcome) for outcome in outcomes])
    (arguments.out_dir / "table.md").write_text(text + "\n", encoding="utf-8")


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1, help="of the goals and of the noise (default: 1)")
    parser.add_argument("--model", type=pathlib.Path, default=ROOT / "models/go1-d7.json")
    parser.add_argument("--rate", type=int, default=500, help="control steps a second (default: 500)")
    parser.add_argument("--romc", type=pathlib.Path, default=ROMC, help="the compiler")
    parser.add_argument("--out-dir", type=pathlib.Path, default=ROOT / "out/accuracy")
    parser.add_argument(
        "--setting", type=named_number, action="append", default=[], metavar="NAME=NUMBER",
        help="a setting of the controller, in place of the one in PLAN.settings.toml",
    )
    parser.add_argument("--quick", action="store_true", help="three goals, the largest size of each fault")
    parser.add_argument("--jobs", type=int, help="runs at a time (default: one per core)")
    arguments = parser.parse_args()
    arguments.out_dir, arguments.romc = arguments.out_dir.resolve(), arguments.romc.resolve()
    arguments.settings = None
    return arguments


def plans(arguments):
    """A Planned for each goal of the seed."""
    inputs = ModelInputs.compiled(arguments.model, arguments.out_dir / "inputs", arguments.romc)
    for goal in drawn_goals(arguments.seed):
        if arguments.quick and goal.name not in QUICK_GOALS:
            continue
        jump, answer = planned(arguments, {"plan": arguments.model}, "plan", goal)
        if jump is None:
            raise SystemExit(f"{goal}: no plan")
        yield Planned(goal, jump, inputs.of(jump), settings_of(answer) | dict(arguments.setting))


def signed_sizes(fault, only_largest):
    """Sizes of a fault; a bias has either sign."""
    sizes = fault.sizes[-1:] if only_largest else fault.sizes
    signs = (1, -1) if fault.kind == "bias" else (1,)
    return [sign * size for size in sizes for sign in signs]


def run(task):
    """One jump; returns its Outcome."""
    arguments, crate, fault, size, plan = task
    goal, jump = plan.goal, plan.jump
    controller = None
    if fault in REPLAYS:
        follower = Replay(jump, REPLAYS[fault])
        follower.feed_forward_in_flight = True
    else:
        controller = made_controller(crate, plan.settings)
        controller.set_reference(jump.time_s, jump.x, jump.dx, plan.u, jump.feet)
        seed = (arguments.seed, *goal.name.encode())
        follower = Estimated(controller, arguments.rate, fault, size * fault.si, seed)
    start = read_jump(start_of(goal))
    simulation = perturbed_simulation(ROBOT, NOMINAL, Floor(), start.x[0], start.dx[0], 0.0)
    log = simulation.run(follower, jump.time_s[-1])
    figures = figures_of(log)
    faults = repetition_faults(target_of(goal), figures, log.other_contact.any())
    landed = np.flatnonzero(~jump.feet.any(axis=1))[-1]
    return Outcome(
        fault=fault.name,
        size=size,
        unit=fault.unit,
        goal=goal.name,
        success=not faults,
        faults="; ".join(faults),
        distance_m=figures.distance_m,
        distance_error_m=figures.distance_m - goal.distance_m,
        apex_error_m=figures.apex_rise_m - goal.apex_m,
        pitch_error_deg=float(log.x[landed, 16] - jump.x[landed, 16]) / DEGREE,
        statuses="; ".join(fallbacks(controller, follower)) if controller else "",
    )


def fallbacks(controller, follower):
    """Names of the statuses without a plan and of the supervisor's that a run had."""
    seen = [status for status in follower.statuses if status < 0 or status >= FIRST_FALLBACK]
    return [controller.status_text(status).split(":")[0] for status in seen]


def table(outcomes):
    """One row per fault and size, both signs of a bias in one. Errors are means and largest of absolute values."""
    exact = {o.goal: o.distance_m for o in outcomes if o.fault == EXACT.name}
    rows = []
    for fault, size, unit in dict.fromkeys((o.fault, abs(o.size), o.unit) for o in outcomes):
        own = [o for o in outcomes if (o.fault, abs(o.size)) == (fault, size)]
        statuses = collections.Counter(s for o in own for s in o.statuses.split("; ") if s)
        row = {
            "fault": fault,
            "size": size,
            "unit": unit,
            "either_sign": any(o.size < 0 for o in own),
            "succeeded": sum(o.success for o in own),
            "runs": len(own),
        }
        errors = {
            "landing_cm": [100 * o.distance_error_m for o in own],
            "moved_cm": [100 * (o.distance_m - exact[o.goal]) for o in own],
            "apex_cm": [100 * o.apex_error_m for o in own],
            "pitch_deg": [o.pitch_error_deg for o in own],
        }
        for name, values in errors.items():
            row[name] = round(float(np.abs(values).mean()), 3)
            row[f"{name}_worst"] = round(float(np.abs(values).max()), 3)
        row["statuses"] = "; ".join(f"{status} {count}" for status, count in statuses.items())
        rows.append(row)
    return rows


def markdown(rows):
    """The rows as a table of Markdown, means with the largest in brackets, and the largest sizes that do no harm."""
    lines = ["| fault | size | success | landing, cm | moved, cm | apex, cm | pitch, deg | statuses |"]
    lines.append("|---|---:|---|---:|---:|---:|---:|---|")
    for row in rows:
        names = ("landing_cm", "moved_cm", "apex_cm", "pitch_deg")
        errors = [f"{row[name]:.2f} ({row[f'{name}_worst']:.1f})" for name in names]
        size = ("±" * row["either_sign"] + f"{row['size']:g} {row['unit']}") if row["unit"] else ""
        success = f"{row['succeeded']} of {row['runs']}"
        lines.append("| " + " | ".join([row["fault"], size, success, *errors, row["statuses"]]) + " |")
    lines += ["", f"| fault | largest size tried that moves landings by at most {HARMLESS_CM:g} cm |", "|---|---:|"]
    for fault in FAULTS:
        lines.append(f"| {fault.name} | {harmless(fault, rows)} |")
    return "\n".join(lines)


def harmless(fault, rows):
    """The largest size up to which all jumps succeed and landings move by at most 1 cm in the mean."""
    largest = 0
    for row in rows:
        if row["fault"] == fault.name:
            if row["moved_cm"] > HARMLESS_CM or row["succeeded"] < row["runs"]:
                break
            largest = row["size"]
    return f"{largest:g} {fault.unit}" if largest else "none"


def write_rows(path, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
