"""Predicts walks by a rigid body of known mass and prints the errors next to those of the model.

    cargo build --release && python3 benches/learning/known_mass.py

The rigid body is a copy of the model in which the centre of mass obeys `ddx = F_x / m`, `ddy = F_y / m` and
`ddz = F_z / m - g`, with the mass of the simulated robot. Forces are the same: joint friction, rotor inertia
and the torques of the links are subtracted. Needs Python alone; a few seconds.
"""

import json
import pathlib
import tempfile

from tables import ROOT, answer, jumps

MASS_KG, GRAVITY_M_S2 = 12.74, 9.81
# Folder and prefix of recordings by title.
SETS = {
    "test trots": ("go1-trot", "test"),
    "other trots": ("go1-trot-other", ""),
    "crawls": ("go1-gaits", "crawl"),
    "pronks": ("go1-gaits", "pronk"),
}
ROWS = (0, 3, 1)  # equations of the centre of mass along x, y and z
FORCE = 12  # place of the force along x in the input


def rigid(model):
    """The copy with the rigid body's equations; terms are 1, z, dz and u, in this order."""
    d, scaling = model["latent_dim"], model["scaling"]
    for phase in model["phases"]:
        if phase["name"] == "flight":
            continue
        xi = phase["xi"]
        for axis, row in enumerate(ROWS):
            for terms in xi:
                terms[row] = 0.0
            xi[1 + 2 * d + row][row] = scaling["state"] / scaling["input"][FORCE + axis] / MASS_KG
        xi[0][ROWS[2]] = -GRAVITY_M_S2 * scaling["state"]
    return model


def errors_mm(model, recordings):
    """Errors of the centre of mass over 0.1 s."""
    found = answer(ROOT / "target/release/romc", "simulate", model, *recordings, "--verbose")
    coordinates = found["horizons"][0]["coordinates"]
    return [f"{1e3 * coordinates[f'com.{axis}']['rms']:.2f}" for axis in "xyz"]


def main():
    path = ROOT / "models/go1-trot-d12.json"
    print("| recordings | | x | y | z |\n|---|---|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as scratch:
        copy = pathlib.Path(scratch) / "rigid.json"
        copy.write_text(json.dumps(rigid(json.loads(path.read_text()))))
        for name, (folder, prefix) in SETS.items():
            for title, model in (("`go1-trot-d12`", path), ("rigid body of known mass", copy)):
                print(f"| {name} | {title} | {' | '.join(errors_mm(model, jumps(folder, prefix)))} |", flush=True)


if __name__ == "__main__":
    main()
