"""Predicts walks by a rigid body of known mass and prints the errors next to those of the model.

    cargo build --release && python3 benches/learning/known_mass.py

The rigid body is a copy of the model in which the centre of mass obeys `ddx = F_x / m`, `ddy = F_y / m` and
`ddz = F_z / m - g`, with the mass of the simulated robot. Forces are the same: joint friction, rotor inertia
and the torques of the links are subtracted. Needs Python alone; a few seconds.
"""

import json
import pathlib
import subprocess
import tempfile

from tables import RECORDINGS, ROOT

MASS_KG, GRAVITY_M_S2 = 12.74, 9.81
SETS = {"test trots": "go1-trot/test_*", "other trots": "go1-trot-other/*", "crawls": "go1-gaits/crawl_*", "pronks": "go1-gaits/pronk_*"}
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


def errors_mm(path, pattern):
    """Errors of the centre of mass over 0.1 s."""
    command = [ROOT / "target/release/romc", "simulate", path, *sorted(RECORDINGS.glob(f"{pattern}.csv.gz")), "--verbose", "--json"]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    coordinates = json.loads(done.stdout)["horizons"][0]["coordinates"]
    return [f"{1e3 * coordinates[f'com.{axis}']['rms']:.2f}" for axis in "xyz"]


def main():
    path = ROOT / "models/go1-trot-d12.json"
    print("| recordings | | x | y | z |\n|---|---|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / "rigid.json"
        copy.write_text(json.dumps(rigid(json.loads(path.read_text()))))
        for name, pattern in SETS.items():
            for title, model in (("`go1-trot-d12`", path), ("rigid body of known mass", copy)):
                print(f"| {name} | {title} | {' | '.join(errors_mm(model, pattern))} |", flush=True)


if __name__ == "__main__":
    main()
