"""Predictions, the verdict and the report of a model, and of broken ones."""

import json
import pathlib

import numpy as np
import pytest
import romc

from conftest import JUMPS, MODELS

PATHS = sorted(JUMPS.glob("test_*.csv.gz"))


def broken(model, factor):
    """The model with all coefficients multiplied: -1 turns their signs, 0 leaves constant velocities."""
    document = model.to_dict()
    for phase in document["phases"]:
        phase["xi"] = (factor * np.array(phase["xi"])).tolist()
    return romc.Model.from_dict(document)


@pytest.fixture(scope="module")
def score(model):
    return model.score(PATHS)


def test_score_is_the_verdict_of_the_command_line(score, command_line):
    answer = command_line.json("simulate", MODELS / "go1-d4.json", *PATHS)
    assert {**answer["verdict"], "unmeasured": None} == score
    assert score["fit_for"] == ["0.1 s", "whole motion", "torques", "control"] and score["failed"] == []
    uses = {row["use"] for row in score["rows"]}
    assert uses == set(score["fit_for"])
    for row in score["rows"]:
        at_most = row["bound"] == "at most"
        assert row["passed"] == (row["value"] <= row["threshold"] if at_most else row["value"] >= row["threshold"])


def test_value_of_a_row_is_the_error_of_the_predictions(model, score):
    errors = []
    for path in PATHS:
        errors.append(model.predict(path)[:, 14] - romc.read(path).x[:, 14])
    [row] = [row for row in score["rows"] if row["name"] == "error of body.z over 0.1 s"]
    assert row["value"] == pytest.approx(np.sqrt(np.mean(np.concatenate(errors) ** 2)), rel=1e-9)
    assert row["value"] < 0.001 < row["baseline"] and row["unit"] == "m"


def test_score_shows_every_row(score):
    text = str(score)
    assert text.startswith("verdict: Fit for predictions over 0.1 s")
    outcomes = [line[2:16].strip() for line in text.splitlines() if line.startswith("  ") and line[2] != " "]
    expected = [
        "not measured" if row["passed"] is None
        else "does not count" if not row["counts"]
        else "passed" if row["passed"] else "FAILED"
        for row in score["rows"]
    ]
    assert outcomes == expected and max(map(len, text.splitlines()[1:])) <= 80


@pytest.mark.parametrize("factor, failed", [(-1.0, ["0.1 s", "whole motion", "torques", "control"]), (0.0, None)])
def test_broken_model_scores_worse(factor, failed, model, score):
    wrong = broken(model, factor).score(PATHS)
    assert {"0.1 s", "whole motion", "torques"} <= set(wrong["failed"]) and "FAILED" in str(wrong)
    assert failed is None or wrong["failed"] == failed
    names = ["error of body.z over 0.1 s", "R^2 of torques in contact"]
    for name, is_worse in zip(names, (np.greater, np.less)):
        [own], [other] = ([row["value"] for row in of["rows"] if row["name"] == name] for of in (score, wrong))
        assert is_worse(other, own), name


def test_predictions_are_those_of_the_rollouts(model, jump):
    [run] = model.simulate(jump, restart_every=0.05).runs
    assert np.array_equal(model.predict(jump, horizon_s=0.05), run.x_restarted)
    assert np.array_equal(model.predict(jump, horizon_s=None), run.x_full)
    assert model.predict(jump).shape == jump.x.shape
    turned = broken(model, -1.0).predict(jump)
    assert np.abs(turned - jump.x)[:, 14].max() > 10 * np.abs(model.predict(jump) - jump.x)[:, 14].max()


def test_predictions_of_several_segments_are_one_below_the_other(model, jump):
    twice = romc.Recording.from_arrays(
        np.concatenate([jump.t, jump.t]),
        *(np.vstack([array, array]) for array in (jump.x, jump.dx, jump.torque, jump.feet)),
        ddx=np.vstack([jump.ddx, jump.ddx]),
    )
    once = model.predict(jump)
    assert len(twice) == 2 and np.array_equal(model.predict(twice), np.vstack([once, once]))


def test_predictions_that_are_not_there_are_refused_with_a_remedy(model, jump):
    with pytest.raises(romc.RomcError, match="horizon_s is -1, expected a number from 1e-3 to 1e4"):
        model.predict(jump, horizon_s=-1)
    with pytest.raises(romc.RomcError, match=r"for several, \[model.predict\(one\) for one in recordings\]"):
        model.predict([jump, jump])
    with pytest.raises(romc.RecordingError, match="found none, expected at least one"):
        model.score([])
    walker = romc.Model.load("go1-trot-d6")
    with pytest.raises(romc.RecordingError, match=r"turns by more than 0.25 rad.*simulate\(recording\).runs"):
        walker.predict(walker.walk(0.5, yaw_rate=0.3, duration=2.0))


def test_report_is_the_page_of_the_command_line(model, command_line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "go1-d4.json").write_bytes((MODELS / "go1-d4.json").read_bytes())
    command_line.json("report", "go1-d4.json", PATHS[0], "--output", "page.html", "--figures", "expected")
    page = model.report(PATHS[0], "own.html", figures="found")
    assert page == pathlib.Path("own.html")
    # The times of the controller's steps differ from run to run.
    expected, found = (
        [line.replace("own.html", "page.html") for line in open(name) if "µs" not in line]
        for name in ("page.html", "own.html")
    )
    assert found == expected and len(found) > 500
    names = sorted(path.name for path in (tmp_path / "found").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "expected").iterdir()) and "encoder.svg" in names
    with pytest.raises(romc.RomcError, match="already exists; pass force=True to replace it"):
        model.report(PATHS[0], page)
    model.report(PATHS[0], page, force=True)
    with pytest.raises(romc.RomcError, match="expected a name that ends in .html"):
        model.report(PATHS[0], tmp_path / "page.txt")


def test_report_on_recordings_in_memory_follows_a_plan(tmp_path, jump):
    model = romc.Model.load("go1-d7")
    page = model.report(jump, tmp_path / "plan.html", plan=model.plan(distance=0.3, apex=0.15))
    assert "--plan plan" in page.read_text()
    wrong = broken(model, -1.0).report(jump, tmp_path / "wrong.html")
    assert "Not fit for" in wrong.read_text()


def test_models_of_the_package_have_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert set(romc.MODELS) == {path.stem for path in MODELS.glob("*.json")}
    for name in romc.MODELS:
        assert romc.Model.load(name) == romc.Model.load(MODELS / f"{name}.json"), name
    with pytest.raises(romc.ModelError, match='go1-d5: no such file .* or one of go1-d2, go1-d4') as caught:
        romc.Model.load("go1-d5")
    assert caught.value.file == "go1-d5"
    # A file of that name comes first.
    (tmp_path / "go1-d4").write_text(json.dumps(broken(romc.Model.load("go1-d4"), -1.0).to_dict()))
    assert romc.Model.load("go1-d4") != romc.Model.load(MODELS / "go1-d4.json")


def test_recordings_of_the_package_are_the_files(jump):
    jumps = romc.recordings("go1")
    assert [recording.path for recording in jumps] == ["test_01", "test_02", "test_03"]
    for recording, path in zip(jumps, PATHS):
        assert np.array_equal(recording.x, romc.read(path, clock="recorded").x)
    with pytest.raises(romc.RecordingError, match='found \'go2\', expected "go1"; romc.read'):
        romc.recordings("go2")
