"""Pinocchio's kinematics of the robots in this folder, for romc's tests to be compared with.

    python reference.py --check     # checks ../../tests/fixtures/robots/reference.json
    python reference.py --write     # writes it

TOML files are built joint by joint in Pinocchio, URDF files are read by Pinocchio itself. Feet are
in the body's frame; Jacobians are by the leg's three joints, in the body's axes. The body of a URDF
is its trunk: `--check` also hangs it below a world, whose frame must not matter.
"""

import argparse
import json
import pathlib
import tomllib

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).resolve().parent
REFERENCE = HERE.parent.parent / "tests" / "fixtures" / "robots" / "reference.json"
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
POSTURES = 25
# Joints of each leg from the trunk to the foot, and the link of the foot.
HARE = {
    leg: ([f"{leg}_swing", f"{leg}_thigh", f"{leg}_shin"], f"{leg}_paw")
    for leg in ("ne", "nw", "se", "sw")
}


def described(path):
    """(model, [(joint names, foot frame)]) of a TOML file, legs in the file's order."""
    entry = tomllib.loads(path.read_text())
    model = pin.Model()
    legs = []
    for index, leg in enumerate(entry["leg"]):
        parent = 0
        for joint in leg["joint"]:
            axis = joint["axis"]
            if isinstance(axis, str):
                sign = -1.0 if axis.startswith("-") else 1.0
                axis = sign * np.array(AXES[axis[-1]], float)
            turns = pin.JointModelRevoluteUnaligned(np.array(axis) / np.linalg.norm(axis))
            place = pin.SE3(np.eye(3), np.array(joint["at"], float))
            parent = model.addJoint(parent, turns, place, joint["name"])
        foot = pin.SE3(np.eye(3), np.array(leg["foot"], float))
        name = f"foot{index}"
        model.addFrame(pin.Frame(name, parent, 0, foot, pin.FrameType.OP_FRAME))
        legs.append(([joint["name"] for joint in leg["joint"]], name))
    return model, legs


# A trunk that a fixed joint holds aside, up and turned; tests/robots.rs reads the same.
WORLD = """<link name="world"/><joint name="held" type="fixed"><parent link="world"/><child link="torso"/>
<origin xyz="0.3 -0.1 2" rpy="0.1 0.2 0.7"/></joint></robot>"""


def read(path, above=""):
    """(model, [(joint names, foot frame)], frame of the body)"""
    if path.suffix == ".toml":
        return *described(path), "universe"
    text = path.read_text()
    if above:
        text = text.replace("</robot>", above)
    return pin.buildModelFromXML(text), list(HARE.values()), "torso"


def sample(path, random, above=""):
    """Random postures: angles by joint name, and foot and Jacobian of each leg."""
    model, legs, body = read(path, above)
    data = model.createData()
    rows = []
    for _ in range(POSTURES):
        angles = {name: random.uniform(-2.5, 2.5) for names, _ in legs for name in names}
        q = pin.neutral(model)
        for name, angle in angles.items():
            joint = model.joints[model.getJointId(name)]
            if joint.nq == 1:
                q[joint.idx_q] = angle
            else:  # a joint without end is kept as cosine and sine
                q[joint.idx_q : joint.idx_q + 2] = np.cos(angle), np.sin(angle)
        pin.framesForwardKinematics(model, data, q)
        pin.computeJointJacobians(model, data, q)
        trunk = data.oMf[model.getFrameId(body)]
        found = []
        for names, frame in legs:
            number = model.getFrameId(frame)
            jacobian = pin.getFrameJacobian(model, data, number, pin.LOCAL_WORLD_ALIGNED)
            columns = [model.joints[model.getJointId(name)].idx_v for name in names]
            found.append(
                {
                    "joints": names,
                    "angles": [angles[name] for name in names],
                    "foot": trunk.actInv(data.oMf[number].translation).tolist(),
                    "jacobian": (trunk.rotation.T @ jacobian[:3, columns]).tolist(),
                }
            )
        rows.append(found)
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    kind = parser.add_mutually_exclusive_group(required=True)
    kind.add_argument("--write", action="store_true")
    kind.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    random = np.random.default_rng(7)
    names = ("solo12.toml", "anymal_c.toml", "hare.urdf")
    found = {name: sample(HERE / name, random) for name in names}
    if arguments.write:
        REFERENCE.write_text(json.dumps(found) + "\n")
        return
    stored = json.loads(REFERENCE.read_text())
    state = np.random.default_rng(7)
    below = {name: sample(HERE / name, state, WORLD) for name in names}
    found["hare.urdf below a world"] = below["hare.urdf"]
    for name, rows in found.items():
        worst = 0.0
        for row, other in zip(rows, stored[name.split(" ")[0]], strict=True):
            for leg, kept in zip(row, other, strict=True):
                for key in ("angles", "foot", "jacobian"):
                    difference = np.abs(np.array(leg[key]) - np.array(kept[key])).max()
                    worst = max(worst, difference)
        print(f"{name}: {POSTURES} postures, largest error of stored values {worst:.1e}")
        if worst > 1e-12:
            raise SystemExit(f"{name}: the stored values are not Pinocchio's; --write them again")


if __name__ == "__main__":
    main()
