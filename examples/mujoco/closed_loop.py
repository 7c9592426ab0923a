"""Drives a simulated Go1 with the latent controller, over recorded jumps and perturbations."""

import argparse
import concurrent.futures
import csv
import json
import pathlib
import sys
from dataclasses import asdict, dataclass

import numpy as np
from PIL import Image

import romc_controller
from assessment import assess, longest_flight, repetition_faults
from film_strip import render
from followers import Jump, LatentMpc, Replay, TorquesOnly, WithoutFeedback
from perturbations import NOMINAL, PERTURBATIONS, Motors, perturbed_simulation
from recording_format import read_recording, states_of
from robot_model import RobotModel
from simulation import CONTROL_STEP_S

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
RECORDINGS = ROOT / "examples/recordings/go1"
ROMC = ROOT / "target/release/romc"
ROBOT = "go1"
EXAMPLE = """example:
  cargo build --release
  MUJOCO_GL=egl python closed_loop.py --out-dir ../../out/closed_loop
drives the shipped model go1-d6 with its generated controller; --models takes others, --folds 3
trains three models, each without another third of the training jumps, --seeds 3 with the joint
method and seeds 1 to 3. Writes closed_loop.csv (a row a run), closed_loop.json, table.txt and a
film strip per test jump, recorded above and driven below."""
QUICK = ("payload +2 kg", "torque x0.9")
FRAMES = 8
LEAST_SHARE = 0.9
LEAST_WITHOUT_INPUT = 2

# Who drives, and whether that depends on the model.
WITH_INPUT, WITHOUT_INPUT = "MPC", "MPC, no recorded input"
FOLLOWERS = {
    WITH_INPUT: True,
    WITHOUT_INPUT: True,
    "MPC, feedback off": True,
    "recorded torques + PD": False,
    "recorded torques alone": False,
    "PD alone": False,
}


@dataclass
class Outcome:
    """One run: what drove which jump under what, and how it ended."""

    model: str
    follower: str
    perturbation: str
    jump: str
    success: bool
    faults: str
    flight_s: float
    apex_rise_m: float
    distance_m: float
    largest_tilt_rad: float
    final_height_m: float
    torque_share: float
    steps_without_plan: int
    median_step_us: float


def main():
    arguments = parse_arguments()
    arguments.out_dir.mkdir(parents=True, exist_ok=True)
    if not arguments.romc.is_file():
        raise SystemExit(f"no {arguments.romc}: cargo build --release")
    models = []
    for path in [*arguments.models, *trained(arguments)]:
        folder = arguments.out_dir / "controllers" / path.stem
        models.append((path.stem, romc_controller.build(path, folder, arguments.romc)))
    jumps = [read_jump(path) for path in sorted(RECORDINGS.glob(f"{arguments.jumps}_*.csv.gz"))]
    perturbations = [NOMINAL]
    perturbations += [p for p in PERTURBATIONS if not arguments.quick or p.name in QUICK]
    settings = dict(arguments.setting)
    tasks = [
        (follower, model, settings, perturbation, jump)
        for follower, has_model in FOLLOWERS.items()
        for model in (models if has_model else [None])
        for perturbation in perturbations
        for jump in jumps
    ]
    outcomes = []
    with concurrent.futures.ProcessPoolExecutor(arguments.jobs) as pool:
        for outcome, _ in pool.map(run, tasks):
            outcomes.append(outcome)
            print(f"\r{len(outcomes)} of {len(tasks)} runs", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    text = table(outcomes, perturbations)
    print(text)
    write_outcomes(arguments.out_dir, outcomes, text)
    if not arguments.no_pictures:
        for jump in jumps:
            _, states = run((WITH_INPUT, models[0], settings, NOMINAL, jump))
            write_strip(arguments.out_dir / f"{jump.name}.png", jump, states)
    missed = missed_aims(outcomes, len(models))
    for aim in missed:
        print(f"MISSED {aim}", file=sys.stderr)
    sys.exit(1 if missed else 0)


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--models", type=pathlib.Path, nargs="+", default=[], help="model files (default: go1-d6)"
    )
    parser.add_argument("--seeds", type=int, default=0, help="train so many joint models as well")
    parser.add_argument(
        "--folds", type=int, default=0, help="train so many models, each without some of the jumps"
    )
    parser.add_argument("--romc", type=pathlib.Path, default=ROMC, help="the compiler")
    parser.add_argument("--out-dir", type=pathlib.Path, default=ROOT / "out/closed_loop")
    parser.add_argument(
        "--jumps", choices=["test", "validation", "train"], default="test", help="which recordings"
    )
    parser.add_argument(
        "--setting",
        type=named_number,
        action="append",
        default=[],
        metavar="NAME=NUMBER",
        help="a setting of the controller, such as velocity_weight=0.02",
    )
    parser.add_argument("--quick", action="store_true", help="two perturbations instead of all")
    parser.add_argument("--no-pictures", action="store_true", help="no film strips")
    parser.add_argument("--jobs", type=int, help="runs at a time (default: one a core)")
    arguments = parser.parse_args()
    arguments.out_dir, arguments.romc = arguments.out_dir.resolve(), arguments.romc.resolve()
    arguments.models = [path.resolve() for path in arguments.models]
    if not (arguments.models or arguments.seeds or arguments.folds):
        arguments.models = [ROOT / "models/go1-d6.json"]
    return arguments


def named_number(text):
    """("name", number) of NAME=NUMBER."""
    name, _, number = text.partition("=")
    return name, float(number)


def trained(arguments):
    """Model files trained for this comparison: joint seeds, closed form on parts of the jumps."""
    jumps = sorted(RECORDINGS.glob("train_*.csv.gz"))
    validation = sorted(RECORDINGS.glob("validation_*.csv.gz"))
    plans = [
        (f"joint-seed-{seed}", jumps, ["--method", "joint", "--seed", seed, "--seeds", 1])
        for seed in range(1, arguments.seeds + 1)
    ] + [
        (
            f"fold-{fold + 1}",
            [jump for row, jump in enumerate(jumps) if row % arguments.folds != fold],
            ["--method", "closed-form"],
        )
        for fold in range(arguments.folds)
    ]
    for name, recordings, options in plans:
        path = arguments.out_dir / f"{name}.json"
        print(f"training {name} on {len(recordings)} jumps", file=sys.stderr)
        romc_controller.train(recordings, validation, path, arguments.romc, options)
        yield path


def read_jump(path):
    """A recorded jump."""
    columns = read_recording(path)
    x, dx, _, torque_nm, feet = states_of(columns)
    return Jump(path.name.removesuffix(".csv.gz"), columns["Time"], x, dx, torque_nm, feet)


def run(task):
    """One closed-loop run; returns its Outcome and the states (rows, 18).

    A task is who drives, (name, generated crate) of the model or None, settings that are not the
    controller's own, the perturbation, the jump.
    """
    follower_name, model, settings, perturbation, jump = task
    robot = RobotModel(ROBOT)
    takeoff_s = jump.time_s[longest_flight(jump.feet)[0]]
    simulation = perturbed_simulation(ROBOT, perturbation, jump.x[0], jump.dx[0], takeoff_s)
    controller = make_controller(follower_name, model, settings, jump, robot)
    follower = make_follower(follower_name, controller, jump)
    motors = Motors(follower, perturbation, robot.torque_limit_nm)
    log = simulation.run(motors, jump.time_s[-1])
    reference = assess(ROBOT, jump.time_s, jump.x, jump.dx, jump.torque_nm, jump.feet)
    times = np.arange(len(log.x)) * CONTROL_STEP_S
    repeated = assess(ROBOT, times, log.x, log.dx, log.torque_nm, log.feet())
    faults = repetition_faults(reference, repeated, log.other_contact.any())
    statuses = getattr(follower, "statuses", {})
    outcome = Outcome(
        model=model[0] if model else "",
        follower=follower_name,
        perturbation=perturbation.name,
        jump=jump.name,
        success=not faults,
        faults="; ".join(faults),
        flight_s=repeated.flight_s,
        apex_rise_m=repeated.apex_rise_m,
        distance_m=repeated.distance_m,
        largest_tilt_rad=repeated.largest_tilt_rad,
        final_height_m=repeated.final_height_m,
        torque_share=repeated.torque_share,
        steps_without_plan=sum(n for s, n in statuses.items() if s < 0 or s >= 10),
        median_step_us=float(np.median(getattr(follower, "solve_us", []) or [0.0])),
    )
    if controller:
        controller.close()
    return outcome, log.x


def make_controller(follower_name, model, settings, jump, robot):
    """The generated controller with its reference set; none for followers without a model."""
    if not FOLLOWERS[follower_name]:
        return None
    module = romc_controller.load(model[1])
    chosen = module.Library().default_settings()
    for name, number in settings.items():
        kind = type(getattr(chosen, name))
        setattr(chosen, name, kind(number))
    controller = module.Controller(chosen)
    u = None if follower_name == WITHOUT_INPUT else jump.inputs(robot)
    controller.set_reference(jump.time_s, jump.x, jump.dx, u, jump.feet)
    return controller


def make_follower(name, controller, jump):
    if name in (WITH_INPUT, WITHOUT_INPUT):
        return LatentMpc(controller)
    if name == "MPC, feedback off":
        return WithoutFeedback(controller, jump)
    if name == "recorded torques alone":
        return TorquesOnly(jump)
    return Replay(jump, with_torques=name == "recorded torques + PD")


def table(outcomes, perturbations):
    """Successes of runs, a row a perturbation and a column a follower."""
    names = [p.name for p in perturbations]
    width = max(map(len, names)) + 2
    lines = ["successful runs of all runs", ""]
    lines.append(" " * width + "".join(f"{name:>24}" for name in FOLLOWERS))

    def cells(chosen):
        counts = []
        for follower in FOLLOWERS:
            runs = [o.success for o in outcomes if o.follower == follower and chosen(o)]
            counts.append(f"{sum(runs)} of {len(runs)}")
        return "".join(f"{count:>24}" for count in counts)

    for name in names:
        lines.append(f"{name:<{width}}" + cells(lambda o, name=name: o.perturbation == name))
    lines.append(f"{'all':<{width}}" + cells(lambda o: True))
    models = sorted({o.model for o in outcomes if o.model})
    for model in models if len(models) > 1 else []:
        lines.append(f"{model:<{width}}" + cells(lambda o, model=model: o.model == model))
    return "\n".join(lines)


def write_outcomes(folder, outcomes, text):
    rows = [asdict(outcome) for outcome in outcomes]
    with open(folder / "closed_loop.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    (folder / "closed_loop.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    (folder / "table.txt").write_text(text + "\n", encoding="utf-8")


def write_strip(path, jump, states):
    """Recorded jump above, driven one below, at the same times."""
    robot = RobotModel(ROBOT)
    rows = np.linspace(0, min(len(jump.x), len(states)) - 1, FRAMES).astype(int)
    strips = [np.hstack(render(robot, x[rows])) for x in (jump.x, states)]
    Image.fromarray(np.vstack(strips)).save(path)


def missed_aims(outcomes, models):
    """Which of the aims that the documentation states these runs do not reach."""

    def share(follower, chosen=lambda o: True):
        runs = [o.success for o in outcomes if o.follower == follower and chosen(o)]
        return sum(runs) / len(runs)

    def nominal(outcome):
        return outcome.perturbation == NOMINAL.name

    missed = []
    if share(WITH_INPUT, nominal) < 1.0:
        missed.append(f"{WITH_INPUT}: all nominal runs succeed")
    if share(WITH_INPUT) < LEAST_SHARE:
        missed.append(f"{WITH_INPUT}: {LEAST_SHARE:.0%} of all runs succeed")
    for baseline in list(FOLLOWERS)[2:]:
        if share(baseline) >= share(WITH_INPUT):
            missed.append(f"{WITH_INPUT}: more runs succeed than with {baseline}")
    succeeded = [o.success for o in outcomes if o.follower == WITHOUT_INPUT and nominal(o)]
    if sum(succeeded) < LEAST_WITHOUT_INPUT * models:
        missed.append(f"{WITHOUT_INPUT}: {LEAST_WITHOUT_INPUT} nominal runs a model succeed")
    return missed


if __name__ == "__main__":
    main()
