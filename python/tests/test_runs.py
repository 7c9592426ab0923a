"""Rollouts and the controller, compared with the command line bit for bit."""

import csv
import json
import threading
import time

import numpy as np
import pytest
import romc

from conftest import JUMPS, MODELS, CommandLine

PATHS = [JUMPS / "test_01.csv.gz", JUMPS / "test_02.csv.gz"]


def table(path):
    """The columns of a CSV file; empty cells are NaN, words stay words."""
    rows = list(csv.reader(path.read_text().splitlines()))

    def number(cell):
        try:
            return float(cell) if cell else np.nan
        except ValueError:
            return cell

    return {name: [number(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}


@pytest.mark.parametrize("name, restart_every", [("go1-d4", 0.1), ("go1-d6", 0.05)])
def test_rollouts_are_those_of_the_command_line(name, restart_every, command_line, tmp_path):
    path = MODELS / f"{name}.json"
    arguments = ["--restart-every", restart_every, "--output", "run.csv"]
    answer = command_line.json("simulate", path, *PATHS, *arguments)
    simulation = romc.Model.load(path).simulate(PATHS, restart_every=restart_every)
    assert simulation.metrics == answer["rollouts"]
    assert simulation.verdict == answer["verdict"]
    assert simulation.verdict["failed"] == []
    columns = table(tmp_path / "run.csv")
    assert len(simulation.runs) == max(columns["segment"]) + 1
    for kind, symbol, names in [
        ("z", "z", [f"z_{i + 1}" for i in range(simulation.runs[0].z.shape[1])]),
        ("dz", "dz", [f"dz_{i + 1}" for i in range(simulation.runs[0].z.shape[1])]),
        ("x", "x", list(answer["rollouts"]["full"]["coordinates"])),
    ]:
        for suffix in ["", "_full", "_restarted"]:
            found = np.vstack([getattr(run, kind + suffix) for run in simulation.runs])
            expected = np.array([columns[name + suffix] for name in names]).T
            assert np.array_equal(found, expected, equal_nan=True), (symbol, suffix)
    assert np.array_equal(np.concatenate([run.t for run in simulation.runs]), columns["time"])
    phases = list(romc.Model.load(path).phases)
    assert [phases[i] for run in simulation.runs for i in run.phase] == columns["phase"]


def test_rms_is_that_of_the_trajectories(model, jump):
    simulation = model.simulate(jump)
    [run] = simulation.runs
    error = run.x_restarted[:, 14] - run.x[:, 14]
    assert simulation.rms("body.z") == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    assert simulation.rms("body.z", "full") >= simulation.rms("body.z")


@pytest.mark.parametrize("lift, reference_input", [("transpose", "recorded"), ("consistent", "none")])
def test_controller_along_a_recording_is_that_of_the_command_line(
    lift, reference_input, model, command_line, tmp_path
):
    arguments = ["--lift", lift, "--reference-input", reference_input, "--output", "mpc.csv"]
    answer = command_line.json("mpc", MODELS / "go1-d4.json", PATHS[0], *arguments)
    run = romc.Controller(model, lift=lift).along(PATHS[0], reference_input)
    [expected] = answer["runs"]
    expected.update(verdict=answer["verdict"], remarks=answer["remarks"], failures=answer["failed"])
    untimed = expected.keys() - {"recording", "step_us", "prepare_us"}
    assert run.summary.keys() == expected.keys()
    assert {key: run.summary[key] for key in untimed} == {key: expected[key] for key in untimed}
    assert run.summary["verdict"]["failed"] == [] and "FAILED" not in str(run)
    columns = table(tmp_path / "mpc.csv")
    torques = np.array([column for name, column in columns.items() if name.endswith(" torque")]).T
    assert np.array_equal(run.torque, torques)
    assert run.status == columns["status"] and list(run.t) == columns["time"]
    assert np.array_equal(run.z_ref, np.array([columns[f"z_ref_{i + 1}"] for i in range(4)]).T)


def test_steps_are_those_along_the_recording(model, jump):
    along = romc.Controller(model).along(jump)
    controller = romc.Controller(model, horizon=20, step=0.01).set_reference(jump)
    samples = np.searchsorted(jump.t, along.t - 1e-9)
    for row, sample in enumerate(samples):
        command = controller.step(jump.t[sample], jump.x[sample], jump.dx[sample], jump.feet[sample])
        assert np.array_equal(command.torque, along.torque[row]), row
        assert np.array_equal(command.u_lat, along.u_lat[row]), row
        assert command.status == along.status[row] and command.has_plan == (command.status_code in range(5))
    assert set(along.status) <= {"solved", "softened", "contact_early", "contact_late", "contact_unknown"}


def test_reference_of_arrays_is_that_of_the_recording(model, jump):
    recorded = romc.Controller(model).set_reference(jump, reference_input="none")
    arrays = romc.Controller(model).set_reference(t=jump.t, x=jump.x, dx=jump.dx, feet=jump.feet)
    measurement = (jump.t[40], jump.x[40], jump.dx[40], jump.feet[40])
    one, other = recorded.step(*measurement), arrays.step(*measurement)
    assert one.status == "solved" and np.array_equal(one.torque, other.torque)


def test_torques_of_a_reference_make_its_input_as_those_of_a_recording_do(model, jump):
    arrays = {"t": jump.t, "x": jump.x, "dx": jump.dx, "torque": jump.torque, "feet": jump.feet}
    recording = romc.Recording.from_arrays(**arrays)
    inputs = {"t": jump.t, "x": jump.x, "dx": jump.dx, "u": recording.inputs(model), "feet": jump.feet}
    references = [{"reference": recording}, arrays, inputs]
    controllers = [romc.Controller(model).set_reference(**reference) for reference in references]
    torques = [of.step(jump.t[40], jump.x[40], jump.dx[40], jump.feet[40]).torque for of in controllers]
    assert np.array_equal(torques[0], torques[1]) and np.array_equal(torques[0], torques[2])
    with pytest.raises(romc.RecordingError, match="`torque`: found `torque` and `u`"):
        romc.Controller(model).set_reference(**inputs, torque=jump.torque)
    with pytest.raises(romc.RecordingError, match="`torque`"):
        romc.Controller(model).set_reference(**{**arrays, "torque": jump.torque[:, :11]})


def test_settings_reach_the_controller(model, jump):
    def torque(**settings):
        controller = romc.Controller(model, **settings).set_reference(jump)
        x = np.array(jump.x[40])
        x[14] += 0.02
        return controller.step(jump.t[40], x, jump.dx[40], jump.feet[40]).torque

    default = torque()
    assert np.array_equal(torque(), default)
    for settings in [{"horizon": 5}, {"input_weight": 1.0}, {"velocity_weight": 1.0}, {"lift": "consistent"}]:
        assert not np.array_equal(torque(**settings), default), settings
    with pytest.raises(romc.RomcError, match="horizon is 0, expected a whole number from 1 to 500"):
        romc.Controller(model, horizon=0)
    for step in [1e9, 0.0, float("nan")]:
        with pytest.raises(romc.RomcError, match="step is .*, expected a number from 1e-4 to 1"):
            romc.Controller(model, step=step)
    with pytest.raises(romc.RomcError, match="restart_every is 1e-300, expected a number from 1e-3 to 1e4"):
        model.simulate(PATHS, restart_every=1e-300)


def test_failures_are_printed_as_the_command_line_prints_them(model, command_line, tmp_path):
    wrong = model.to_dict()
    for phase in wrong["phases"]:
        phase["xi"] = (-np.array(phase["xi"])).tolist()
    (tmp_path / "wrong.json").write_text(json.dumps(wrong))
    printed = command_line.run("mpc", "wrong.json", PATHS[0]).stdout.splitlines()
    run = romc.Controller(romc.Model.load(tmp_path / "wrong.json")).along(PATHS[0])
    shown = str(run).splitlines()
    verdict = next(place for place, line in enumerate(shown) if line.startswith(("FAILED", "verdict")))
    assert any(line.startswith("FAILED along test_01") for line in shown)
    assert any(line.startswith("FAILED control") for line in shown)
    assert [line for line in shown[verdict:] if line not in printed] == []
    assert "control" in run.summary["verdict"]["failed"] and run.summary["failure"]


def test_settings_are_those_of_the_table(model, jump):
    settings = romc.Controller(model).settings
    assert (settings["horizon"], settings["step_s"], settings["lift"]) == (20, 0.01, "transpose")
    others = {"solver": "riccati", "after_end": "damp", "linearisation": "last_plan", "body_friction": 0.5, "horizon": 9}
    others.update(tilt_rad=float("inf"), frozen_steps=0, drive_stiffness_nm_rad=30.0)
    controller = romc.Controller(model, **others)
    assert controller.settings == {**settings, **others}
    assert romc.Controller(model, **controller.settings).settings == controller.settings
    assert romc.Controller(model, lift=1, after_end=2).settings["after_end"] == "stop"
    for name, value, message in [
        ("lift", "up", 'lift: found "up", expected one of transpose, consistent'),
        ("after_end", "now", 'after_end: found "now", expected one of hold, damp, stop'),
        ("after_end", 3, "setting `after_end` is 3, expected 0 .hold., 1 .damp. or 2 .stop."),
        ("tilt_rad", -1.0, "setting `tilt_rad` is -1, expected a positive number or infinity"),
        ("tilt_rad", "far", "tilt_rad: found 'far', expected a number"),
        ("frozen_steps", 1.5, "frozen_steps is 1.5, expected a whole number"),
        ("tilt", 0.5, 'setting: found "tilt", expected one of horizon, .*, tilt_rad, '),
        ("step_s", 0.02, "step: found step and step_s, expected one of them"),
    ]:
        with pytest.raises(romc.RomcError, match=message):
            romc.Controller(model, **{name: value, "step": 0.01})


def test_bounds_and_the_end_reach_the_command(model, jump):
    def last(x=jump.x[40], t=jump.t[40], dx=jump.dx[40], **settings):
        controller = romc.Controller(model, clock_gap_s=float("inf"), **settings).set_reference(jump)
        controller.step(t, x, dx, jump.feet[40])
        return controller.step(t + 0.03, x, dx, jump.feet[40])

    tilted = np.array(jump.x[40])
    tilted[16] += 0.7
    assert last(tilted).source == "damping" and last(tilted).status in ("not_at_start", "tilt")
    assert last(tilted, tilt_rad=float("inf")).source != "damping"
    assert set(romc.STATUSES) >= {"solved", "ended", "tilt", "poor_steps", "no_reference"}
    assert romc.STATUSES["tilt"].endswith("damping until reset")
    end_s, at_end = jump.t[-1] + 1.0, (jump.x[-1], jump.dx[-1])
    ends = {end: last(at_end[0], end_s, at_end[1], after_end=end) for end in ("hold", "damp", "stop")}
    assert ends["hold"].status != "ended" and ends["hold"].stiffness == 20.0 and ends["hold"].damping == 0.8
    for end in ("damp", "stop"):
        assert ends[end].status == "ended" and ends[end].stiffness < 20.0, end


def test_prepared_step_gives_the_same_command(model, jump):
    commands = []
    for is_prepared in (False, True):
        controller = romc.Controller(model, solver="riccati").set_reference(jump)
        if is_prepared:
            controller.prepare(jump.t[40])
        commands.append(controller.step(jump.t[40], jump.x[40], jump.dx[40], jump.feet[40]))
    assert np.array_equal(commands[0].torque, commands[1].torque) and commands[1].has_plan


def test_measurement_that_makes_no_sense_gets_a_safe_command(model, jump):
    controller = romc.Controller(model)
    measurement = [jump.t[0], jump.x[0], jump.dx[0], jump.feet[0]]
    command = controller.step(*measurement)
    assert (command.status, command.status_code) == ("no_reference", -3)
    controller.set_reference(jump)
    broken = np.array(jump.x[0])
    broken[3] = np.nan
    command = controller.step(jump.t[0], broken, jump.dx[0], jump.feet[0])
    assert command.status == "not_finite" and np.all(np.abs(command.torque) <= 35.55)
    command = controller.step(jump.t[0], jump.x[0][:5], jump.dx[0], jump.feet[0])
    assert command.status == "wrong_dimension" and not command.has_plan
    assert controller.step(*measurement).status == "solved"


def test_fault_of_a_reference_names_sample_and_array(model, jump):
    dx = jump.dx.copy()
    dx[7, 2] = np.inf
    with pytest.raises(romc.RecordingError) as caught:
        romc.Controller(model).set_reference(t=jump.t, x=jump.x, dx=dx, feet=jump.feet)
    assert (caught.value.row, caught.value.column) == (7, "dx")
    with pytest.raises(romc.RecordingError) as caught:
        romc.Controller(model).set_reference(t=jump.t, x=jump.x[:-1], dx=jump.dx, feet=jump.feet)
    assert "x" in str(caught.value)


def test_long_calls_let_other_threads_run(model):
    began = time.perf_counter()
    model.simulate(PATHS)
    alone = time.perf_counter() - began
    done = threading.Event()
    worker = threading.Thread(target=lambda: (model.simulate(PATHS), done.set()))
    worker.start()
    turns = 0
    while not done.is_set():
        time.sleep(alone / 50)
        turns += 1
    worker.join()
    # A call that keeps the interpreter lets this loop turn once.
    assert turns >= 10, f"{turns} turns in a call of {alone:.2f} s"


@pytest.fixture(scope="module")
def planner(tmp_path_factory):
    """A model with landmarks and a prior over goals, trained by the command line."""
    folder = tmp_path_factory.mktemp("planner")
    jumps = [sorted(JUMPS.glob(f"{kind}_*.csv.gz")) for kind in ("train", "validation")]
    arguments = ["--latent-dim", "6", "--actuators", "identify", "--output", "planner.json"]
    CommandLine(folder).json("train", *jumps[0], "--validation", *jumps[1], *arguments)
    return folder / "planner.json"


def test_walk_is_that_of_the_command_line(command_line, tmp_path):
    path = MODELS / "go1-trot-d6.json"
    goal = ["--speed", "0.5", "--yaw-rate", "0.2", "--duration", "1", "--output", "walk.csv"]
    command_line.json("plan", path, *goal)
    walk = romc.Model.load(path).walk(0.5, yaw_rate=0.2, duration=1.0)
    written = romc.read(tmp_path / "walk.csv")
    for name in ["t", "x", "dx", "torque", "feet"]:
        assert np.array_equal(getattr(walk, name), getattr(written, name)), name
    with pytest.raises(romc.RomcError, match="speed 3"):
        romc.Model.load(path).walk(3.0)


def test_plan_is_that_of_the_command_line_and_is_followed(planner, command_line, tmp_path):
    model = romc.Model.load(planner)
    answer = command_line.json("plan", planner, "--distance", "0.3", "--apex", "0.15", "--output", "plan.csv")
    plan = model.plan(distance=0.3, apex=0.15)
    untimed = {key: value for key, value in plan.summary.items() if key != "solve_ms"}
    assert untimed == {key: answer[key] for key in untimed}
    written = romc.read(tmp_path / "plan.csv")
    for name in ["t", "x", "dx", "torque", "feet"]:
        assert np.array_equal(getattr(plan, name), getattr(written, name)), name
    assert plan.x[-1, 12] - plan.x[0, 12] == pytest.approx(0.3, abs=0.02)
    controller = romc.Controller(model).set_reference(plan)
    assert controller.step(plan.t[0], plan.x[0], plan.dx[0], plan.feet[0]).has_plan
    with pytest.raises(romc.RomcError):
        model.plan(distance=5.0, apex=0.1)


def test_model_without_a_prior_says_so():
    with pytest.raises(romc.ModelError) as caught:
        romc.Model.load(MODELS / "paper-2d.json").plan(distance=0.3, apex=0.1)
    assert caught.value.tensor
