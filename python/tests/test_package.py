"""The command line of the wheel, the examples, the type annotations."""

import csv
import json
import pathlib
import re
import runpy
import subprocess
import sys
import sysconfig
import time

import numpy as np
import pytest
import romc

from conftest import JUMPS, ROOT

EXAMPLES = ROOT / "python" / "examples"


def test_console_script_is_the_command_line():
    script = pathlib.Path(sysconfig.get_path("scripts")) / "romc"
    version = subprocess.run([script, "--version"], capture_output=True, text=True)
    assert (version.returncode, version.stdout) == (0, f"romc {romc.__version__}\n")
    wrong = subprocess.run([script, "compile"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "Usage" in wrong.stderr
    failed = subprocess.run([script, "simulate", "none.json", "none.csv"], capture_output=True, text=True)
    assert failed.returncode == 1 and failed.stderr.startswith("error: none.json")
    helped = subprocess.run([sys.executable, "-m", "romc", "--help"], capture_output=True, text=True)
    assert helped.returncode == 0 and "simulate" in helped.stdout


def test_quick_start_shows_equations_and_verdict_from_an_empty_folder(tmp_path):
    script = EXAMPLES / "quick_start.py"
    assert len(script.read_text().splitlines()) == 10
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-W", "error", script], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert time.perf_counter() - began < 60 and not list(tmp_path.iterdir())
    assert "z2  centre of mass upwards, m; input u2 in N\n" in done.stdout and "  ddz2 = -9.81\n" in done.stdout
    [error_mm] = re.findall(r"largest error of the body's height over 0.1 s: (.*) mm", done.stdout)
    assert 0.1 < float(error_mm) < 10
    assert "verdict: Fit for predictions over 0.1 s" in done.stdout and "FAILED" not in done.stdout


def test_model_from_numpy_is_the_command_line_to_the_bit(command_line, tmp_path, monkeypatch, capsys):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    script = EXAMPLES / "from_numpy.py"
    assert len(script.read_text().splitlines()) <= 25
    made = runpy.run_path(str(script))
    model, command, test = made["model"], made["command"], JUMPS / "test_01.csv.gz"
    # The model: its arrays through a file.
    arrays = {f"xi.{phase}": xi for phase, xi in made["xi"].items()}
    arrays.update({"encoder.weight": made["W"], "encoder.bias": -made["W"] @ made["mean"]})
    arrays.update({"decoder.weight": made["W"].T, "decoder.bias": made["mean"]})
    np.savez("pca.npz", **arrays)
    training = sorted(JUMPS.glob("train_*.csv.gz"))
    arguments = ["--library", "degree=1,inputs", "--scaling", "1", "--robot", "go1", "--inputs-from", *training]
    command_line.json("import", "pca.npz", *arguments, "--output", "pca.json")
    imported, own = romc.Model.load("pca.json").to_dict(), model.to_dict()
    assert [document.pop("provenance")["format"] for document in (imported, own)] == ["npz", "arrays"]
    assert imported == own
    # Equations and code.
    command_line.json("compile", "pca.json", "--emit", "latex,c", "--out-dir", "expected")
    emitted = sorted(path.name for path in (tmp_path / "expected").iterdir() if not path.name.startswith("."))
    assert "pca.c" in emitted and "pca.tex" in emitted
    digests = [romc.Model.load("pca.json").digest, model.digest]
    for name in emitted:
        texts = [(tmp_path / folder / name).read_text() for folder in ("expected", "out/pca")]
        # A model file's digest covers where the model came from.
        expected, found = (text.replace(digest[:16], "") for text, digest in zip(texts, digests))
        assert found == expected, name
    # Rollouts.
    rollouts = command_line.json("simulate", "pca.json", test, codes=(0, 1))["rollouts"]
    rms = rollouts["restarted"]["coordinates"]["body.z"]["rms"]
    printed = capsys.readouterr().out
    assert f"rms of body.z, m: {rms!r}" in printed and r"\ddot{z}_1" in printed and "solved" in printed
    # The controller's step.
    command_line.json("mpc", "pca.json", test, "--output", "steps.csv", codes=(0, 1))
    first = next(csv.DictReader((tmp_path / "steps.csv").open()))
    assert first["status"] == command.status
    assert [float(cell) for name, cell in first.items() if name.endswith(" torque")] == command.torque.tolist()


def test_notebook_has_the_outputs_of_a_run(tmp_path):
    path = EXAMPLES / "jump.ipynb"
    assert path.stat().st_size < 500_000
    run = tmp_path / "run.ipynb"
    done = subprocess.run([sys.executable, EXAMPLES / "run_notebook.py", run], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    stored, fresh = (json.loads(of.read_text())["cells"] for of in (path, run))

    def shown(cells):
        """Texts and formulas of each cell, and how many pictures it has."""
        outputs = [cell.get("outputs", []) for cell in cells]
        texts = [[output.get("text") or output["data"].get("text/latex") for output in of] for of in outputs]
        return texts, [sum("image/png" in output.get("data", {}) for output in of) for of in outputs]

    # Else `python python/examples/run_notebook.py` stores the outputs of today.
    assert shown(stored) == shown(fresh)
    texts, pictures = shown(stored)
    text = str(texts)
    assert sum(pictures) == 2 and r"\\ddot{z}_2 = -9.81" in text and "  ddz2 = -9.81" in text
    assert "verdict: Fit for predictions" in text and "failed, wrong signs: ['0.1 s', " in text
    assert not any(output.get("name") == "stderr" for cell in stored for output in cell.get("outputs", []))


def test_annotations_hold(tmp_path):
    pytest.importorskip("mypy")
    package = pathlib.Path(romc.__file__).parent
    assert (package / "py.typed").is_file()
    command = [sys.executable, "-m", "mypy", "--strict", "-p", "romc"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_public_names_are_documented():
    for name in romc.__all__:
        value = getattr(romc, name)
        if name == "__version__":
            continue
        assert value.__doc__, name
        if isinstance(value, type):
            for member, entry in vars(value).items():
                if not member.startswith("_") and (callable(entry) or isinstance(entry, property)):
                    assert entry.__doc__, f"{name}.{member}"
