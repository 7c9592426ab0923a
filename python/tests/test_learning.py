"""Training, studies and what recordings show of a robot, compared with the command line."""

import os
import re
import signal
import threading
import time
import tomllib

import numpy as np
import pandas
import pytest
import romc
from romc._options import StudyOptions, TrainOptions

from conftest import JUMPS, ROOT

TRAINING = sorted(JUMPS.glob("train_*.csv.gz"))[:4]
VALIDATION = [JUMPS / "validation_01.csv.gz"]
TEST = [JUMPS / "test_01.csv.gz"]


def learnt(**options):
    return romc.train(TRAINING, latent_dim=2, **options)


def test_trained_model_is_that_of_the_command_line(command_line, tmp_path):
    sets = [*TRAINING, "--validation", *VALIDATION, "--test", *TEST]
    settings = ["--latent-dim", "3", "--slack", "0.3", "--terms", "1; z1; z2; dz1; dz2; dz3; u1; u2; u3"]
    expected = command_line.json("train", *sets, *settings, "--output", "jump.json")
    terms = ["1", "z1", "z2", "dz1", "dz2", "dz3", "u1", "u2", "u3"]
    options = {"latent_dim": 3, "slack": 0.3, "terms": terms, "name": "jump"}
    model = romc.train(TRAINING, validation=VALIDATION, test=TEST, **options)
    assert model.digest == romc.Model.load(tmp_path / "jump.json").digest
    assert model.training["report"] == expected["report"] and model.training["test"] == expected["test"]
    assert not (tmp_path / "model.json").exists()


def test_recordings_in_memory_train_as_their_files():
    recordings = [romc.read(path) for path in TRAINING]
    assert romc.train(recordings, latent_dim=2) == learnt()
    arrays = [
        romc.Recording.from_arrays(jump.t, jump.x, jump.dx, jump.torque, jump.feet, ddx=jump.ddx) for jump in recordings
    ]
    model = romc.train(arrays, latent_dim=2)
    for phase, xi in learnt().xi.items():
        assert np.array_equal(model.xi[phase], xi), phase
    # Four recordings with one name get different names.
    assert "romc train arrays arrays-2 arrays-3 arrays-4 " in model.to_dict()["provenance"]["command"]


def test_model_is_refined_on_other_recordings(command_line, tmp_path):
    base, others = learnt(name="base"), sorted((JUMPS.parent / "go1-other").glob("*.csv.gz"))
    base.save(tmp_path / "base.json")
    command_line.json("train", *others, "--from", "base.json", "--output", "refined.json")
    refined = romc.train(others, from_=base, name="refined")
    assert refined.digest == romc.Model.load(tmp_path / "refined.json").digest
    assert any(not np.array_equal(refined.xi[phase], xi) for phase, xi in base.xi.items())


@pytest.mark.parametrize(
    "options, message",
    [
        ({"latent_dim": 99}, "invalid value '99' for latent_dim: expected a whole number from 1 to 18"),
        ({}, "latent_dim: found none, expected a number of latent coordinates, for example latent_dim=4"),
        ({"latent_dims": 4}, "train: found the option `latent_dims`; did you mean `latent_dim`?"),
        ({"latent_dim": 12}, 'expected 1 to 9 .*`body="all"`, `coordinates="free"` and `mask_std="0"` allow more'),
        ({"latent_dim": 2, "method": "magic"}, "invalid value 'magic' for method: expected one of closed-form, joint"),
        ({"latent_dim": 2, "phases": {"rear": "7"}}, "for phases: found \"rear=7\", expected NAME=any"),
        ({"latent_dim": 2, "activation": "elu"}, "expected `encoder_layers=` or `decoder_layers=` as well"),
        ({"latent_dim": 2, "robot": "go9"}, "unknown robot `go9`; known: go1, go2, a1"),
        ({"latent_dim": 2, "body": object()}, "expected a number, a word, a path, a list of them, or True"),
    ],
)
def test_options_that_do_not_fit_are_named_with_a_remedy(options, message):
    with pytest.raises(romc.RomcError, match=message):
        romc.train(TRAINING, **options)


def test_recordings_that_do_not_fit_are_named(tmp_path):
    with pytest.raises(romc.RecordingError, match="no such file") as caught:
        romc.train([*TRAINING, tmp_path / "none.csv"], latent_dim=2)
    assert caught.value.file == str(tmp_path / "none.csv")
    with pytest.raises(romc.RecordingError, match=r"found none, expected at least one .*: romc.read\(path\)"):
        romc.train([], latent_dim=2)
    with pytest.raises(romc.RecordingError, match=r"found int, expected paths or recordings: romc.read\(path\)"):
        romc.train([3], latent_dim=2)


def test_notes_of_a_training_are_warnings():
    with pytest.warns(romc.RomcWarning, match="seed=: the closed form finds the same model from every start"):
        learnt(seed=3)
    with pytest.warns(romc.RomcWarning, match="the same recording as .*train_01.csv.gz, and counts twice"):
        romc.train([*TRAINING, TRAINING[0]], latent_dim=2)


def test_ctrl_c_ends_a_training_and_leaves_python_its_signal():
    long = {"method": "joint", "seeds": 1, "epochs": 100_000}
    # A shell without job control starts programs in the background with the signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        for _ in range(2):
            threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
            began = time.perf_counter()
            with pytest.raises(KeyboardInterrupt):
                learnt(**long)
            assert time.perf_counter() - began < 30
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert learnt().latent_dim == 2


@pytest.mark.parametrize("command, options, own", [
    ("train", TrainOptions, {"latent_dim", "validation", "test", "from_", "name", "phase", "output", "force"}),
    ("study", StudyOptions, {"latent_dims", "validation", "seeds", "out_dir", "merge", "force"}),
])
def test_options_are_those_of_the_command_line(command, options, own, command_line):
    text = command_line.run(command, "--help").stdout
    flags = {flag.replace("-", "_") for flag in re.findall(r"^ +(?:-\w, )?--([a-z-]+)", text, re.MULTILINE)}
    flags -= {"json", "help", "version", "verbose"}  # output of the command line alone
    renamed = {"from": "from_", "lambda": "lambda_"}
    assert {renamed.get(flag, flag) for flag in flags} == set(options.__annotations__) | own


def test_study_has_the_table_of_the_command_line(command_line, tmp_path):
    arguments = ["--validation", *VALIDATION, "--latent-dims", "2,4,10", "--seeds", "2", "--out-dir", "study"]
    expected = command_line.json("study", *TRAINING, *arguments)["summary"]["dimensions"]
    options = {"validation": VALIDATION, "latent_dims": [2, 4, 10], "seeds": 2}
    table = romc.study(TRAINING, **options, as_frame=False)
    assert [row["latent_dim"] for row in table] == [2, 4] and table[0]["trained"] == 2
    for row, of in zip(table, expected):
        for name in ("decoder_mse", "active", "combined_loss", "torque_r2", "prediction_z_m"):
            assert (row[f"{name}_mean"], row[f"{name}_std"]) == (of[name]["mean"], of[name]["std"]), name
    # More coordinates reconstruct better; with two, the inputs that act on the joints are lost.
    assert table[1]["decoder_mse_mean"] < 0.1 * table[0]["decoder_mse_mean"]
    assert table[1]["torque_r2_mean"] > 0.9 > table[0]["torque_r2_mean"]
    frame = romc.study(TRAINING, **options, per="training", out_dir=tmp_path / "kept")
    assert isinstance(frame, pandas.DataFrame) and list(frame["seed"]) == [1, 2] * 3
    assert frame["refused"].notna().sum() == 2 and 'body="all"' in frame["refused"].iloc[-1]
    assert frame["prediction_z_m"][:2].mean() == pytest.approx(table[0]["prediction_z_m_mean"])
    assert (tmp_path / "kept" / "summary.csv").read_bytes() == (tmp_path / "study" / "summary.csv").read_bytes()


def test_study_refuses_what_it_does_not_have():
    with pytest.raises(romc.RomcError, match='per: found \'seed\', expected "dimension" or "training"'):
        romc.study(TRAINING, per="seed")
    with pytest.raises(romc.RomcError, match="for latent_dims: found `0`, expected 4, 1..18 or 2,4,6"):
        romc.study(TRAINING, latent_dims=0)
    with pytest.raises(romc.RomcError, match="did you mean `latent_dims`?"):
        romc.study(TRAINING, latent_dim=3)


def test_identification_is_that_of_the_command_line(command_line, tmp_path):
    paths = sorted(JUMPS.glob("test_*.csv.gz"))
    expected = command_line.json("identify", *paths, "--robot", "go1", "--output", "found.toml")
    found = romc.identify(paths, robot="go1")
    assert found.to_toml() == (tmp_path / "found.toml").read_text()
    assert (found.mass, found.gravity, found.delay) == tuple(
        expected[name] for name in ("mass_kg", "gravity_m_s2", "delay_s")
    )
    assert found.standard_error == expected["standard_error"] and found.notes == expected["notes"]
    # The simulated robot: 12.74 kg, 9.81 m/s^2.
    assert found.mass == pytest.approx(12.74, abs=3 * found.standard_error["mass_kg"])
    assert found.gravity == pytest.approx(9.81, abs=0.05)
    for array, name in [
        (found.viscous_friction, "viscous_nm_s_rad"), (found.dry_friction, "dry_nm"), (found.armature, "armature_kg_m2")
    ]:
        assert array.shape == (12,) and array[:3] == pytest.approx(list(expected[name].values()))
    assert tomllib.loads(found.to_toml())["mass_kg"] == pytest.approx(found.mass, rel=1e-5)
    assert "12.7" in str(found) and str(found) in command_line.run("identify", *paths, "--robot", "go1").stdout
    found.save(tmp_path / "own.toml")
    with pytest.raises(romc.RomcError, match="already exists; pass force=True to replace it"):
        found.save(tmp_path / "own.toml")
    model = learnt(actuators=tmp_path / "own.toml")
    assert model.to_dict()["actuators"]["viscous"] == pytest.approx(list(found.viscous_friction), rel=1e-5)


def test_identification_of_recordings_that_say_nothing_is_refused(jump):
    still = romc.Recording.from_arrays(
        jump.t, np.repeat(jump.x[:1], len(jump.t), 0), 0 * jump.dx, jump.torque, np.ones_like(jump.feet)
    )
    with pytest.raises(romc.RecordingError, match="the legs move"):
        romc.identify(still)
    with pytest.raises(romc.RomcError, match="unknown robot `go9`; known: go1"):
        romc.identify(jump, "go9")


def test_inspection_of_a_recording_finds_what_cannot_be(jump, command_line):
    [expected] = command_line.json("inspect", TEST[0])["files"]
    found = romc.inspect(TEST[0])
    assert found.summary == expected and found.is_plausible
    assert found.metrics["weight_share"] == pytest.approx(1.0, abs=0.05)
    assert found.metrics["fall_m_s2"] == pytest.approx(-9.81, abs=0.5) and found.metrics["foot_slip_m"] < 0.005
    assert found.ranges["body.z"]["position"] == [jump.x[:, 14].min(), jump.x[:, 14].max()]
    assert [segment["samples"] for segment in found.segments] == [len(jump.t)]
    assert str(found) == command_line.run("inspect", TEST[0]).stdout
    # Torques in other units, and a velocity beyond the motors' limits.
    dx = jump.dx.copy()
    dx[100, 4] = 500.0
    wrong = romc.Recording.from_arrays(jump.t, jump.x, dx, 0.001 * jump.torque, jump.feet, ddx=jump.ddx)
    broken = romc.inspect(wrong)
    assert not broken.is_plausible and broken.metrics["weight_share"] == pytest.approx(0.0, abs=0.01)
    assert any("torques in other units" in words for words in broken.mismatches)
    assert any(run["column"] == "fl.hy Velocity" and run["value"] == 500.0 for run in broken.implausible)


def test_inspection_of_a_model_has_its_physics(model, command_line):
    path = ROOT / "models" / "go1-d4.json"
    [expected] = command_line.json("inspect", path)["files"]
    for found in (romc.inspect(path), romc.inspect(model)):
        assert {**found.summary, "file": None} == {**expected, "file": None}
    assert found.invariance["gravity_m_s2"] == pytest.approx(9.81) and found.phases["flight"]["feet"] == "none"
    assert found.provenance == model.to_dict()["provenance"]
    negated = model.to_dict()
    for phase in negated["phases"]:
        phase["xi"] = (-np.array(phase["xi"])).tolist()
    assert romc.inspect(romc.Model.from_dict(negated)).invariance["gravity_m_s2"] == pytest.approx(-9.81)
    assert romc.inspect(romc.Model.load("paper-2d")).invariance is None
