"""Drives a simulated Go1 with the latent controller, over recorded jumps and perturbations."""

import argparse
import csv
import functools
import json
import pathlib
import sys
from dataclasses import asdict, dataclass

import numpy as np
from PIL import Image

import c_controller
import romc_controller
from assessment import assess, longest_flight, repetition_faults
from closed_loop_table import missed_aims, summary, table
from film_strip import render
from followers import FIRST_SUPERVISED, Jump, LatentMpc, Replay, TorquesOnly, WithoutFeedback
from jump_sets import recorded_floor
from model_inputs import ModelInputs
from parallel import results_of
from perturbations import NOMINAL, PERTURBATIONS, Motors, perturbed_simulation
from recording_format import read_recording, states_of
from robot_model import RobotModel
from simulation import CONTROL_STEP_S
from uninformed import write_uninformed

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TRAINING = ROOT / "examples/recordings/go1"
RECORDINGS = [TRAINING, ROOT / "examples/recordings/go1-other"]
ROMC = ROOT / "target/release/romc"
ROBOT = "go1"
EXAMPLE = """example:
  cargo build --release
  MUJOCO_GL=egl python closed_loop.py --out-dir ../../out/closed_loop
drives the shipped model go1-d7 with its generated controller over the test jumps of the training's
recorder and over those of another one; --models selects others, --recordings other folders, --folds 3
trains three models, each without another third of the training jumps, --seeds 3 with the joint
method and seeds 1 to 3. Writes closed_loop.csv (one row per run), closed_loop.json, table.txt and
a film strip for each jump of the first folder given, recorded above and driven below."""
QUICK = ("payload +2 kg", "torque x0.9")
QUICK_STRIDE = 3
FRAMES = 8


@dataclass(frozen=True)
class Driver:
    """Who drives: the controller of a `model`, of its copy that is `uninformed`, or neither."""

    model: bool = False
    uninformed: bool = False
    recorded_input: bool = True


FOLLOWERS = {
    "MPC": Driver(model=True),
    "MPC, no recorded input": Driver(model=True, recorded_input=False),
    "MPC, feedback off": Driver(model=True),
    "no dynamics": Driver(model=True, uninformed=True),
    "no dynamics, no recorded input": Driver(model=True, uninformed=True, recorded_input=False),
    "recorded torques + PD": Driver(),
    "recorded torques alone": Driver(),
    "PD alone": Driver(),
}


@dataclass(frozen=True)
class Controlled:
    """A model by name, its generated controller, that of its uninformed copy, the copy's gains by
    phase, and the rule of the model's inputs."""

    name: str
    crate: pathlib.Path
    uninformed_crate: pathlib.Path
    gains: dict
    inputs: ModelInputs


@dataclass
class Outcome:
    """One run: follower, jump, perturbation, and the result."""

    recordings: str
    model: str
    follower: str
    perturbation: str
    jump: str
    draw: int
    success: bool
    faults: str
    flight_s: float
    apex_rise_m: float
    distance_m: float
    apex_error_m: float
    distance_error_m: float
    largest_tilt_rad: float
    final_height_m: float
    torque_share: float
    steps_without_plan: int
    supervisor_status: int  # the first from 20 on, or 0
    median_step_us: float


def main():
    arguments = parse_arguments()
    arguments.out_dir.mkdir(parents=True, exist_ok=True)
    if not arguments.romc.is_file():
        raise SystemExit(f"no {arguments.romc}: cargo build --release")
    models = [controlled(path, arguments) for path in [*arguments.models, *trained(arguments)]]
    jumps = [path for folder in arguments.recordings for path in jumps_in(folder, arguments)]
    perturbations = [NOMINAL]
    perturbations += [p for p in PERTURBATIONS if not arguments.quick or p.name in QUICK]
    settings = dict(arguments.setting)
    tasks = [
        (follower, model, settings, perturbation, jump, draw)
        for follower in arguments.followers
        for model in (models if FOLLOWERS[follower].model else [None])
        for perturbation in perturbations
        for jump in jumps
        for draw in range(arguments.draws)
    ]
    outcomes = [outcome for outcome, _ in results_of(run, tasks, arguments.jobs)]
    missed = missed_aims(outcomes, TRAINING.name, len(models))
    report = summary(outcomes, perturbations, {m.name: m.gains for m in models}, missed)
    text = table(report)
    print(json.dumps(report, indent=1) if arguments.json else text)
    write_outcomes(arguments.out_dir, outcomes, text)
    if not arguments.no_pictures:
        for path in jumps_in(arguments.recordings[0], arguments):
            _, states = run(("MPC", models[0], settings, NOMINAL, path, 0))
            jump = read_jump(path)
            write_strip(arguments.out_dir / f"{jump.name}.png", jump, states)
    for aim in missed:
        print(f"MISSED {aim}", file=sys.stderr)
    sys.exit(1 if missed else 0)


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--models", type=pathlib.Path, nargs="+", default=[], help="model files (default: go1-d7)"
    )
    parser.add_argument("--seeds", type=int, default=0, help="train so many joint models as well")
    parser.add_argument(
        "--folds", type=int, default=0, help="train so many models, each without some of the jumps"
    )
    parser.add_argument("--romc", type=pathlib.Path, default=ROMC, help="the compiler")
    parser.add_argument("--out-dir", type=pathlib.Path, default=ROOT / "out/closed_loop")
    parser.add_argument(
        "--jumps",
        choices=["test", "validation", "train"],
        default="test",
        help="which recordings of a folder (default: test; an unsplit folder is for testing)",
    )
    parser.add_argument(
        "--recordings",
        type=pathlib.Path,
        nargs="+",
        metavar="PATH",
        help="folders of jumps, or single ones (default: go1, and go1-other with --jumps test)",
    )
    parser.add_argument(
        "--followers",
        choices=FOLLOWERS,
        nargs="+",
        default=list(FOLLOWERS),
        metavar="NAME",
        help="rows of the table (default: all of them)",
    )
    parser.add_argument(
        "--draws",
        type=int,
        help="runs per condition, each with other random numbers (default: 3; --quick: 1)",
    )
    parser.add_argument(
        "--controller",
        choices=["crate", "c"],
        default="crate",
        help="drive with the generated crate, or with the controller in C99",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object, not the table")
    parser.add_argument(
        "--setting",
        type=named_number,
        action="append",
        default=[],
        metavar="NAME=NUMBER",
        help="a setting of the controller, such as velocity_weight=0.02",
    )
    parser.add_argument(
        "--quick", action="store_true", help="two perturbations, a third of the unsplit folders"
    )
    parser.add_argument("--no-pictures", action="store_true", help="no film strips")
    parser.add_argument("--jobs", type=int, help="runs at a time (default: one per core)")
    arguments = parser.parse_args()
    arguments.out_dir, arguments.romc = arguments.out_dir.resolve(), arguments.romc.resolve()
    arguments.models = [path.resolve() for path in arguments.models]
    if arguments.recordings is None:
        arguments.recordings = RECORDINGS if arguments.jumps == "test" else [TRAINING]
    arguments.recordings = [path.resolve() for path in arguments.recordings]
    if arguments.draws is None:
        arguments.draws = 1 if arguments.quick else 3
    if arguments.draws < 1:
        parser.error("--draws: at least 1")
    if not (arguments.models or arguments.seeds or arguments.folds):
        arguments.models = [ROOT / "models/go1-d7.json"]
    return arguments


def named_number(text):
    """("name", number) of NAME=NUMBER."""
    name, _, number = text.partition("=")
    return name, float(number)


def trained(arguments):
    """Model files trained for this comparison: joint seeds, closed form on parts of the jumps."""
    jumps = sorted(TRAINING.glob("train_*.csv.gz"))
    validation = sorted(TRAINING.glob("validation_*.csv.gz"))
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


def controlled(path, arguments):
    """Generates and builds the controllers of a model file and of its uninformed copy."""
    folder = arguments.out_dir / "controllers"
    copy = folder / f"{path.stem}-uninformed.json"
    training = sorted(TRAINING.glob("train_*.csv.gz"))
    inputs = ModelInputs.compiled(path, folder / f"{path.stem}-inputs", arguments.romc)
    gains = write_uninformed(path, copy, training, inputs.of)
    kind = c_controller if arguments.controller == "c" else romc_controller
    crate = kind.build(path, folder / path.stem, arguments.romc)
    uninformed_crate = kind.build(copy, folder / copy.stem, arguments.romc)
    return Controlled(path.stem, crate, uninformed_crate, gains, inputs)


def jumps_in(folder, arguments):
    """Recordings of a folder: those of the split asked for; an unsplit folder is for testing. Of a
    recording, itself."""
    if folder.is_file():
        return [folder]
    paths = sorted(folder.glob(f"{arguments.jumps}_*.csv.gz"))
    unsplit = not paths and arguments.jumps == "test"
    if unsplit:
        paths = sorted(folder.glob("jump_*.csv.gz"))
        paths = paths[::QUICK_STRIDE] if arguments.quick else paths
    if not paths:
        names = f"{arguments.jumps}_*.csv.gz"
        raise SystemExit(f"{folder}: holds no {names}" + " or jump_*.csv.gz" * unsplit)
    return paths


@functools.cache
def read_jump(path):
    """A recorded jump."""
    columns = read_recording(path)
    x, dx, _, torque_nm, feet = states_of(columns)
    name = path.name.removesuffix(".csv.gz")
    folder = path.parent.name
    floor = recorded_floor(folder, name)
    return Jump(name, columns["Time"], x, dx, torque_nm, feet, folder, floor)


@functools.cache
def recorded_input(path, inputs):
    """(rows, 18) input of a recorded jump by the rule of a model."""
    return inputs.of(read_jump(path))


def run(task):
    """One closed-loop run; returns its Outcome and the states (rows, 18).

    A task is who drives, the Controlled model or None, settings that are not the controller's own,
    the perturbation, the file of the jump, the number of the draw.
    """
    follower_name, model, settings, perturbation, path, draw = task
    jump = read_jump(path)
    takeoff_s = jump.time_s[longest_flight(jump.feet)[0]]
    simulation = perturbed_simulation(
        ROBOT, perturbation, jump.floor, jump.x[0], jump.dx[0], takeoff_s, draw
    )
    controller = make_controller(follower_name, model, settings, path)
    follower = make_follower(follower_name, controller, jump)
    motors = Motors(follower, perturbation, simulation.robot.torque_limit_nm)
    log = simulation.run(motors, jump.time_s[-1])
    reference = assess(ROBOT, jump.time_s, jump.x, jump.dx, jump.torque_nm, jump.feet)
    times = np.arange(len(log.x)) * CONTROL_STEP_S
    repeated = assess(ROBOT, times, log.x, log.dx, log.torque_nm, log.feet())
    faults = repetition_faults(reference, repeated, log.other_contact.any())
    statuses = getattr(follower, "statuses", {})
    outcome = Outcome(
        recordings=jump.folder,
        model=model.name if model else "",
        follower=follower_name,
        perturbation=perturbation.name,
        jump=jump.name,
        draw=draw,
        success=not faults,
        faults="; ".join(faults),
        flight_s=repeated.flight_s,
        apex_rise_m=repeated.apex_rise_m,
        distance_m=repeated.distance_m,
        apex_error_m=repeated.apex_rise_m - reference.apex_rise_m,
        distance_error_m=repeated.distance_m - reference.distance_m,
        largest_tilt_rad=repeated.largest_tilt_rad,
        final_height_m=repeated.final_height_m,
        torque_share=repeated.torque_share,
        steps_without_plan=sum(n for s, n in statuses.items() if s < 0 or s >= 10),
        supervisor_status=next((s for s in statuses if s >= FIRST_SUPERVISED), 0),
        median_step_us=float(np.median(getattr(follower, "solve_us", []) or [0.0])),
    )
    if controller:
        controller.close()
    return outcome, log.x


def make_controller(follower_name, model, settings, path):
    """The generated controller with its reference set; none for followers without a model."""
    driver = FOLLOWERS[follower_name]
    if not driver.model:
        return None
    crate = model.uninformed_crate if driver.uninformed else model.crate
    module = c_controller.load(crate) if crate.name.endswith("-c") else romc_controller.load(crate)
    chosen = module.Library().default_settings()
    for name, number in settings.items():
        kind = type(getattr(chosen, name))
        setattr(chosen, name, kind(number))
    controller = module.Controller(chosen)
    jump = read_jump(path)
    u = recorded_input(path, model.inputs) if driver.recorded_input else None
    controller.set_reference(jump.time_s, jump.x, jump.dx, u, jump.feet)
    return controller


def make_follower(name, controller, jump):
    if name == "MPC, feedback off":
        return WithoutFeedback(controller, jump)
    if controller:
        return LatentMpc(controller)
    if name == "recorded torques alone":
        return TorquesOnly(jump)
    return Replay(jump, with_torques=name == "recorded torques + PD")


def write_outcomes(folder, outcomes, text):
    rows = [asdict(outcome) for outcome in outcomes]
    with open(folder / "closed_loop.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    (folder / "closed_loop.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    (folder / "table.txt").write_text(text + "\n", encoding="utf-8")


def write_strip(path, jump, states, first=0, last=None):
    """Jump to follow above, driven one below, at the same times; from row `first` to `last`."""
    robot = RobotModel(ROBOT)
    end = min(len(jump.x), len(states)) - 1
    rows = np.linspace(first, end if last is None else min(last, end), FRAMES).astype(int)
    strips = [np.hstack(render(robot, x[rows])) for x in (jump.x, states)]
    Image.fromarray(np.vstack(strips)).save(path)


if __name__ == "__main__":
    main()
