"""Models, recordings and the command line that results are compared with."""

import json
import os
import pathlib
import subprocess
import sys

import pytest
import romc

ROOT = pathlib.Path(__file__).parents[2]
MODELS = ROOT / "models"
JUMPS = ROOT / "examples" / "recordings" / "go1"


class CommandLine:
    """`romc` of the wheel, or the binary that ROMC_BINARY names."""

    def __init__(self, folder):
        self.folder = folder
        binary = os.environ.get("ROMC_BINARY")
        self.start = [os.path.abspath(binary)] if binary else [sys.executable, "-m", "romc"]

    def run(self, *arguments):
        """The finished process."""
        command = [*self.start, *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, cwd=self.folder)

    def json(self, *arguments, codes=(0,)):
        """The object that a command prints; it must end with one of the exit codes, of which 1 is a verdict on a model."""
        done = self.run(*arguments, "--json")
        assert done.returncode in codes, done.stderr
        return json.loads(done.stdout)


@pytest.fixture
def command_line(tmp_path):
    return CommandLine(tmp_path)


@pytest.fixture(scope="session")
def model():
    """A shipped model with encoder, decoder, robot and input statistics."""
    return romc.Model.load(MODELS / "go1-d4.json")


@pytest.fixture(scope="session")
def jump():
    """A recorded jump of one segment."""
    return romc.read(JUMPS / "test_01.csv.gz")
