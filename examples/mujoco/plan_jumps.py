"""Plans new jumps, simulates them on a Go1, and compares them with methods without a plan."""

import argparse
import csv
import functools
import json
import pathlib
import subprocess
import sys
import tomllib
from dataclasses import asdict, dataclass, replace

import numpy as np

import c_controller
import romc_controller
from assessment import assess, longest_flight, repetition_faults
from closed_loop import named_number, read_jump, write_strip
from followers import LatentMpc, Replay
from model_inputs import ModelInputs
from parallel import results_of
from perturbations import NOMINAL, PERTURBATIONS, Motors, perturbed_simulation
from primitives import Goal, Recorded
from robot_model import Floor
from simulation import CONTROL_STEP_S
from uninformed import write_uninformed

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
RECORDINGS = ROOT / "examples/recordings/go1"
ROMC = ROOT / "target/release/romc"
ROBOT = "go1"
INSIDE, OUTSIDE = 12, 6
STRIP_MARGIN_S = 0.14  # of a film strip, before take-off and after landing
CONDITIONS = (NOMINAL, *(p for p in PERTURBATIONS if p.short in ("+1 kg", "tau 0.9")))
EXAMPLE = """example:
  cargo build --release
  python plan_jumps.py --seed 1 --out-dir ../../out/plan_jumps
draws 12 goals inside the range of the training jumps and 6 outside (up to 35 % further, 40 % higher
than any of them) from the seed, plans each from the start of a test jump, and drives the simulated
robot: the plan with the model's generated controller and with joint PD alone. Baselines are replays,
blends and regressions of the training jumps. --ablations adds rows of plans by changed models.
Writes plan_jumps.csv (one row per run), plan_jumps.json, table.txt, every plan and, with
--strips (and MUJOCO_GL=egl where there is no display), film strips."""


@dataclass(frozen=True)
class Method:
    """Where the reference comes from and who follows it: the controller, or joint PD."""

    source: str
    controller: bool


METHODS = {
    "plan, controller": Method("plan", True),
    "plan, PD": Method("plan", False),
    "nearest jump, PD": Method("nearest", False),
    "blend of three nearest, PD": Method("blend", False),
    "goal regression, PD": Method("regression", False),
    "goal regression, controller": Method("regression", True),
    "nearest jump, controller": Method("nearest", True),
    "plan by the no-dynamics model, controller": Method("uninformed", True),
}
KINDS = {"crate": romc_controller, "c": c_controller}
ABLATIONS = (
    "no refit: the phases' own Xi",
    "Xi of deviations zero",
    "Xi of deviations random",
    "no goal in the prior",
    "no prior: standing still",
)


@dataclass
class Outcome:
    """One run: method, goal, conditions, and the result."""

    method: str
    condition: str
    goal: str
    inside: bool
    success: bool
    faults: str
    distance_goal_m: float
    apex_goal_m: float
    distance_error_m: float
    apex_error_m: float
    pitch_error_rad: float  # where the reference touches down
    take_off_late_s: float
    input_deviation: float
    solve_ms: float


def main():
    arguments = parse_arguments()
    arguments.out_dir.mkdir(parents=True, exist_ok=True)
    goals = drawn_goals(arguments.seed)
    models = {"plan": arguments.model}
    copy = arguments.out_dir / "models/uninformed.json"
    folder = arguments.out_dir / "controllers"
    inputs = ModelInputs.compiled(
        arguments.model, folder / f"{arguments.model.stem}-inputs", arguments.romc
    )
    training = sorted(RECORDINGS.glob("train_*.csv.gz"))
    write_uninformed(arguments.model, copy, training, inputs.of)
    models["uninformed"] = copy
    methods = {name: METHODS[name] for name in arguments.methods}
    if arguments.ablations:
        for name in ABLATIONS:
            models[name] = ablated(arguments, name)
            methods[name] = Method(name, True)
    plans = (planned(arguments, models, "plan", goal) for goal in goals)
    answer = next((answer for jump, answer in plans if jump is not None), None)
    if answer is None:
        raise SystemExit("no goal has a plan")
    arguments.setting = settings_of(answer) | dict(arguments.setting)
    crate = KINDS[arguments.controller].build(arguments.model, folder / arguments.model.stem, arguments.romc)
    tasks = [
        (arguments, models, inputs, crate, name, method, goal, condition)
        for name, method in methods.items()
        for condition in CONDITIONS
        if not arguments.nominal or condition is NOMINAL
        for goal in goals
    ]
    outcomes = results_of(run, tasks, arguments.jobs)
    text = table(outcomes)
    rows = [asdict(outcome) for outcome in outcomes]
    print(json.dumps(rows, indent=1) if arguments.json else text)
    with open(arguments.out_dir / "plan_jumps.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    results = json.dumps(rows, indent=1) + "\n"
    (arguments.out_dir / "plan_jumps.json").write_text(results, encoding="utf-8")
    (arguments.out_dir / "table.txt").write_text(text + "\n", encoding="utf-8")


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1, help="of the goals (default: 1)")
    parser.add_argument("--model", type=pathlib.Path, default=ROOT / "models/go1-d7.json")
    parser.add_argument("--romc", type=pathlib.Path, default=ROMC, help="the compiler")
    parser.add_argument("--out-dir", type=pathlib.Path, default=ROOT / "out/plan_jumps")
    parser.add_argument(
        "--methods", choices=METHODS, nargs="*", default=list(METHODS), metavar="NAME",
        help="rows of the table (default: all)",
    )
    parser.add_argument("--ablations", action="store_true", help="plans by changed models as well")
    parser.add_argument("--nominal", action="store_true", help="no payload, no weak motors")
    parser.add_argument("--settings", type=pathlib.Path, help="weights of the plan, a TOML file")
    parser.add_argument(
        "--setting", type=named_number, action="append", default=[], metavar="NAME=NUMBER",
        help="a setting of the controller, in place of the one in PLAN.settings.toml",
    )
    parser.add_argument(
        "--strips", action="store_true",
        help="a film strip of each nominal plan with the controller, planned above, jumped below",
    )
    parser.add_argument(
        "--controller", choices=KINDS, default="crate", help="the generated crate, or the controller in C99"
    )
    parser.add_argument("--rate", type=int, default=100, help="control steps a second (default: 100)")
    parser.add_argument("--json", action="store_true", help="print JSON, not the table")
    parser.add_argument("--jobs", type=int, help="runs at a time (default: one per core)")
    arguments = parser.parse_args()
    arguments.out_dir, arguments.romc = arguments.out_dir.resolve(), arguments.romc.resolve()
    return arguments


@functools.cache
def recorded():
    """The training jumps."""
    return Recorded([read_jump(path) for path in sorted(RECORDINGS.glob("train_*.csv.gz"))])


@functools.cache
def starts():
    """The test jumps, whose first rows the runs start from in turn."""
    return sorted(RECORDINGS.glob("test_*.csv.gz"))


def drawn_goals(seed):
    """12 goals among the training jumps, 6 beyond them: further, higher, and both."""
    random = np.random.default_rng(seed)
    known = recorded().goals
    goals = []
    for number in range(INSIDE):
        weights = random.dirichlet(np.full(len(known), 0.3))
        distance, apex, _ = weights @ known
        goals.append(Goal(f"in{number:02}", float(distance), float(apex)))
    far, high = known[:, 0].max(), known[:, 1].max()
    middle = [np.quantile(known[:, axis], (0.25, 0.75)) for axis in (0, 1)]
    for number in range(OUTSIDE):
        further, higher = random.uniform(1.05, 1.35), random.uniform(1.05, 1.4)
        distance, apex = far * further, high * higher
        if number % 3 == 0:
            apex = random.uniform(*middle[1])
        elif number % 3 == 1:
            distance = random.uniform(*middle[0])
        else:
            # Both at once, half as far beyond.
            distance, apex = far * (1 + further) / 2, high * (1 + higher) / 2
        goals.append(Goal(f"out{number:02}", float(distance), float(apex)))
    return goals


def start_of(goal):
    """The test jump whose start a goal's runs have."""
    number = int(goal.name.removeprefix("in").removeprefix("out"))
    return starts()[number % len(starts())]


def planned(arguments, models, source, goal):
    """The plan of a model for a goal: (Jump, answer of romc); None without a plan."""
    name = "".join(c if c.isalnum() else "_" for c in f"{source}-{goal.name}")
    output = arguments.out_dir / "plans" / f"{name}.csv.gz"
    output.parent.mkdir(exist_ok=True)
    command = [arguments.romc, "plan", models[source], "--distance", goal.distance_m]
    command += ["--apex", goal.apex_m, "--start", start_of(goal), "--output", output]
    command += ["--force", "--json"]
    if arguments.settings:
        command += ["--settings", arguments.settings]
    answer = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if answer.returncode != 0:
        print(f"\n{source} {goal}: {answer.stderr.strip()}", file=sys.stderr)
        return None, {}
    return read_jump(output), json.loads(answer.stdout)


def settings_of(answer):
    """Settings of the controller that romc wrote next to a plan."""
    return tomllib.loads(pathlib.Path(answer["settings"]).read_text(encoding="utf-8"))


def reference_of(arguments, models, source, goal):
    """The trajectory that a method follows, and the report of romc about it."""
    if source == "nearest":
        return recorded().nearest(goal), {}
    if source == "blend":
        return recorded().blend(goal), {}
    if source == "regression":
        return recorded().regression(goal, read_jump(start_of(goal)).x[0, 14]), {}
    return planned(arguments, models, source, goal)


def run(task):
    """One run; returns its Outcome."""
    arguments, models, inputs, crate, name, method, goal, condition = task
    reference, answer = reference_of(arguments, models, method.source, goal)
    outcome = Outcome(
        name, condition.name, goal.name, goal.name.startswith("in"), False, "no plan",
        goal.distance_m, goal.apex_m, np.nan, np.nan, np.nan, np.nan,
        answer.get("input_deviation", np.nan), answer.get("solve_ms", np.nan),
    )
    if reference is None:
        return outcome
    start = read_jump(start_of(goal))
    in_flight = np.flatnonzero(~reference.feet.any(axis=1))
    takeoff_s = reference.time_s[in_flight[0]]
    simulation = perturbed_simulation(
        ROBOT, condition, Floor(), start.x[0], start.dx[0], takeoff_s
    )
    controller = None
    if method.controller:
        controller = made_controller(crate, arguments.setting)
        u = inputs.of(reference)
        controller.set_reference(reference.time_s, reference.x, reference.dx, u, reference.feet)
        follower = LatentMpc(controller)
        follower.step_s = 1 / arguments.rate
    else:
        follower = Replay(reference, with_torques=True)
    # Of these references, torques in flight are known: they swing the legs.
    follower.feed_forward_in_flight = True
    motors = Motors(follower, condition, simulation.robot.torque_limit_nm)
    log = simulation.run(motors, reference.time_s[-1])
    if controller:
        controller.close()
    repeated = figures_of(log)
    faults = repetition_faults(target_of(goal), repeated, log.other_contact.any())
    outcome.success, outcome.faults = not faults, "; ".join(faults)
    outcome.distance_error_m = repeated.distance_m - goal.distance_m
    outcome.apex_error_m = repeated.apex_rise_m - goal.apex_m
    landed = min(in_flight[-1], len(log.x) - 1)
    outcome.pitch_error_rad = float(log.x[landed, 16] - reference.x[in_flight[-1], 16])
    left = longest_flight(log.feet())[0]
    outcome.take_off_late_s = float((left - in_flight[0]) * CONTROL_STEP_S)
    if arguments.strips and name == "plan, controller" and condition.name == NOMINAL.name:
        margin = round(STRIP_MARGIN_S / CONTROL_STEP_S)
        path = arguments.out_dir / f"{goal.name}.png"
        write_strip(path, reference, log.x, in_flight[0] - margin, in_flight[-1] + margin)
    return outcome


def target_of(goal):
    """Figures of the jump that a goal wants."""
    wanted = recorded().regression(goal, read_jump(start_of(goal)).x[0, 14])
    target = assess(ROBOT, wanted.time_s, wanted.x, wanted.dx, wanted.torque_nm, wanted.feet)
    return replace(target, distance_m=goal.distance_m, apex_rise_m=goal.apex_m)


def figures_of(log):
    """Figures of a run; its distance is that forwards."""
    times = np.arange(len(log.x)) * CONTROL_STEP_S
    figures = assess(ROBOT, times, log.x, log.dx, log.torque_nm, log.feet())
    return replace(figures, distance_m=float(log.x[-1, 12] - log.x[0, 12]))


def made_controller(crate, settings):
    """The generated controller with settings that are not its own."""
    kind = c_controller if crate.name.endswith("-c") else romc_controller
    module = kind.load(crate)
    chosen = module.Library().default_settings()
    for setting, number in settings.items():
        setattr(chosen, setting, type(getattr(chosen, setting))(number))
    return module.Controller(chosen)


def ablated(arguments, name):
    """A copy of the model file without one part that planning uses."""
    model = json.loads(arguments.model.read_text(encoding="utf-8"))
    parts, d = model["prior"]["parts"], model["latent_dim"]
    random = np.random.default_rng(0)
    for part in parts:
        xi = np.array(part["xi"])
        if name.startswith("no refit"):
            del part["xi"]
        elif name.endswith("zero"):
            part["xi"] = np.zeros_like(xi).tolist()
        elif name.endswith("random"):
            part["xi"] = random.permuted(xi).tolist()
        elif name.startswith("no goal"):
            part["duration_s"][1:] = [0.0] * 3
            for key in ("z", "dz", "u_lat"):
                rows = np.array(part[key])
                rows[:, d:] = 0.0
                part[key] = rows.tolist()
        elif name.startswith("no prior"):
            part["duration_s"][1:] = [0.0] * 3
            still = np.array(parts[0]["z"][0])[:d]
            for key in ("z", "dz", "u_lat"):
                rows = np.zeros_like(np.array(part[key]))
                if key == "z":
                    rows[:, :d] = still
                if key == "u_lat":
                    rows[:, :d] = np.array(part[key])[:, :d].mean(axis=0)
                part[key] = rows.tolist()
    path = arguments.out_dir / "models" / ("".join(c for c in name if c.isalnum()) + ".json")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(model), encoding="utf-8")
    return path


def table(outcomes):
    """Successes and mean absolute errors, one row per method and condition."""
    head = ["method", "condition", "inside", "d cm", "apex cm", "outside", "d cm", "apex cm"]
    rows = [head]
    keys = dict.fromkeys((o.method, o.condition) for o in outcomes)
    for method, condition in keys:
        cells = [method, condition]
        for inside in (True, False):
            own = [o for o in outcomes if (o.method, o.condition) == (method, condition)]
            own = [o for o in own if o.inside == inside]
            errors = np.array([[o.distance_error_m, o.apex_error_m] for o in own])
            distance, apex = 100 * np.nanmean(np.abs(errors), axis=0)
            ok = sum(o.success for o in own)
            cells += [f"{ok} of {len(own)}", f"{distance:.2f}", f"{apex:.2f}"]
        rows.append(cells)
    widths = [max(len(row[k]) for row in rows) for k in range(len(head))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in rows]
    times = [o.solve_ms for o in outcomes if o.method.startswith("plan") and o.solve_ms > 0]
    if times:
        lines.append(f"plans: median {np.median(times):.0f} ms, at most {max(times):.0f} ms")
    return "\n".join(line.rstrip() for line in lines)


if __name__ == "__main__":
    main()
