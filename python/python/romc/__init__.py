"""Reduced-order models of legged robots: equations, code, rollouts, control.

>>> import romc
>>> model = romc.Model.load("models/go1-d4.json")
>>> jump = romc.read("examples/recordings/go1/test_01.csv.gz")
>>> model.simulate(jump).metrics["restarted"]["coordinates"]["body.z"]["rms"]

Arrays have one row per sample, in SI units: states `x` are `(n, 18)` (12 joint angles in rad, body position in m,
roll, pitch, yaw in rad), torques `(n, 12)` in N m, feet `(n, 4)` booleans in the order fr, fl, rr, rl. Latent
quantities are `(n, d)` in the model's scaled units.
"""

from romc._romc import __version__
from romc.controller import STATUSES, Command, ControlRun, Controller
from romc.equations import Equations
from romc.errors import ModelError, RecordingError, RomcError, RomcWarning
from romc.library import Library
from romc.model import Model, Simplified
from romc.plan import Plan
from romc.recording import Recording, Segment, guess_columns, read
from romc.simulation import Simulation, SimulatedSegment

__all__ = [
    "Command",
    "ControlRun",
    "Controller",
    "Equations",
    "Library",
    "Model",
    "ModelError",
    "Plan",
    "Recording",
    "RecordingError",
    "RomcError",
    "RomcWarning",
    "STATUSES",
    "Segment",
    "Simplified",
    "SimulatedSegment",
    "Simulation",
    "__version__",
    "guess_columns",
    "read",
]
