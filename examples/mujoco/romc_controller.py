"""The controller of a model as romc generates it: compiled, built, and loaded through ctypes."""

import importlib.util
import json
import os
import pathlib
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
# Compiled dependencies, shared by the controllers of all models.
TARGET = ROOT / "target/generated-controllers"


def emitted(model, target, folder, romc, ending):
    """Emits a target of a model file into a folder; returns the only file there whose path ends so."""
    emit = [romc, "compile", model, "--emit", target, "--out-dir", folder, "--force", "--json"]
    done = subprocess.run([str(part) for part in emit], check=True, stdout=subprocess.PIPE, text=True)
    paths = [file["path"] for file in json.loads(done.stdout)["files"]]
    (path,) = [path for path in paths if path.endswith(ending)]
    return pathlib.Path(path)


def build(model, folder, romc):
    """Generates and builds the controller of a model file; returns the folder of its crate."""
    crate = emitted(model, "controller", folder, romc, "-controller/Cargo.toml").parent
    environment = {**os.environ, "CARGO_TARGET_DIR": str(TARGET)}
    subprocess.run(
        ["cargo", "build", "--release", "--quiet"], check=True, cwd=crate, env=environment
    )
    # Models of the same name make libraries of the same name: each crate keeps its own.
    module = load(crate)
    module.LIBRARY.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(TARGET / "release" / module.LIBRARY.name, module.LIBRARY)
    return crate


def load(crate):
    """The Python module that comes with a generated crate."""
    (path,) = crate.glob("python/*_controller.py")
    specification = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def train(recordings, validation, output, romc, options):
    """Trains a model file, by default with six latent coordinates."""
    command = [romc, "train", *recordings, "--validation", *validation, "--output", output, "--force"]
    command += ["--latent-dim", 6, *options]
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
