"""Simulated jumps of any robot that romc reads, as recordings.

    python jumps.py solo12.toml --out-dir jumps/solo12 --romc ../../target/release/romc

`romc robot FILE --json` describes the robot. MuJoCo gets a model of it with the trunk's share of the
mass in a box and the legs' in capsules. The controller of `../mujoco` makes it jump. Heights and speeds are those of a Go1 scaled by the length of the legs.
"""

import argparse
import json
import pathlib
import subprocess
import sys
from dataclasses import replace

import mujoco
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "mujoco"))

import jump_controller  # noqa: E402
from assessment import longest_flight  # noqa: E402
from recording_format import write_recording  # noqa: E402
from robot_model import FRICTION, LEGS, PHYSICS_STEP_S  # noqa: E402
from simulation import Simulation  # noqa: E402

WARMUP_S, LONGEST_S = 0.3, 1.6
# Shares of the mass: trunk, then of each leg hip, thigh, calf.
TRUNK, PARTS = 0.66, (0.03, 0.04, 0.015)
GO1_LEG_M, GO1_MASS_KG = 0.426, 12.0


class DescribedRobot:
    """A robot of `romc robot --json` on a flat floor; the interface of `RobotModel`."""

    def __init__(self, entry):
        self.name, self.friction = entry["name"], FRICTION
        self.legs = entry["leg"]
        joints = [joint for leg in self.legs for joint in leg["joint"]]
        self.torque_limit_nm = np.array([joint["torque_nm"] for joint in joints])
        self.joint_limit_rad = np.array([joint["limits_rad"] for joint in joints])
        self.axes = [[axis_of(joint) for joint in leg["joint"]] for leg in self.legs]
        self.links = [
            [np.array(p) for p in (leg["joint"][1]["at"], leg["joint"][2]["at"], leg["foot"])]
            for leg in self.legs
        ]
        self.hip_position_m = np.array([leg["joint"][0]["at"] for leg in self.legs])
        across = [np.cross(a[1], v) for a, v in zip(self.axes, self.links, strict=True)]
        self.leg_m = float(np.mean([np.linalg.norm(v[1:], axis=1).sum() for v in across]))
        self.foot_radius_m = 0.05 * self.leg_m
        self.seeds = [self.bent(leg) for leg in range(4)]
        self.hip_offset_m = np.array(
            [self.foot_position(leg, self.seeds[leg])[1] for leg in range(4)]
        )
        self.mj = mujoco.MjSpec.from_string(self.mjcf(entry["mass_kg"])).compile()
        self.mass_kg = float(self.mj.body_mass.sum())
        names = [f"{leg}{k}" for leg in LEGS for k in range(3)]
        found = [self.mj.joint(name) for name in names]
        self.qpos_index = np.array([joint.qposadr[0] for joint in found])
        self.dof_index = np.array([joint.dofadr[0] for joint in found])
        self.actuator_index = np.array([self.mj.actuator(name).id for name in names])
        self.foot_geom = np.array([self.mj.geom(leg).id for leg in LEGS])
        self.foot_body = self.mj.geom_bodyid[self.foot_geom]
        self.trunk_body = self.mj.body("trunk").id
        self.floor_geom = self.mj.geom("floor").id

    def mjcf(self, mass_kg):
        """The MuJoCo model; only trunk, feet and floor collide."""
        front, side = np.abs(self.hip_position_m[:, :2]).max(axis=0)
        radius = self.foot_radius_m
        size = f"{0.9 * front:.5f} {0.8 * side:.5f} {0.1 * self.leg_m:.5f}"
        trunk = f'<geom type="box" size="{size}" mass="{TRUNK * mass_kg}" contype="0" conaffinity="1"/>'
        bodies, motors = [], []
        for leg, (name, axes) in enumerate(zip(LEGS, self.axes, strict=True)):
            text, ends = "", ""
            places = [self.hip_position_m[leg], *self.links[leg][:2]]
            for k, (place, axis, share) in enumerate(zip(places, axes, PARTS, strict=True)):
                low, high = self.joint_limit_rad[3 * leg + k]
                end = self.links[leg][k]
                thick = 0.3 * radius
                text += (
                    f'<body name="{name}{k}" pos="{numbers(place)}"><joint name="{name}{k}" '
                    f'axis="{numbers(axis)}" range="{low} {high}" damping="{0.004 * mass_kg}" '
                    f'armature="{2e-4 * mass_kg * self.leg_m:.6f}"/><geom type="capsule" '
                    f'size="{thick}" fromto="0 0 0 {numbers(end)}" mass="{share * mass_kg}" '
                    'contype="0" conaffinity="0"/>'
                )
                ends += "</body>"
                limit = self.torque_limit_nm[3 * leg + k]
                motors.append(
                    f'<motor name="{name}{k}" joint="{name}{k}" ctrlrange="{-limit} {limit}"/>'
                )
            foot = self.links[leg][2]
            text += (
                f'<geom name="{name}" type="sphere" size="{radius}" pos="{numbers(foot)}" '
                f'mass="{0.002 * mass_kg}" contype="0" conaffinity="1" priority="1" '
                f'friction="{FRICTION} 0.02 0.01" condim="6"/>'
            )
            bodies.append(text + ends)
        return f"""<mujoco><compiler angle="radian" autolimits="true"/>
<option timestep="{PHYSICS_STEP_S}" integrator="implicitfast" cone="elliptic" impratio="10"/>
<worldbody><geom name="floor" type="plane" size="0 0 0.05" contype="1" conaffinity="0"
 friction="{FRICTION} 0.02 0.01"/><body name="trunk"><freejoint/>{trunk}{"".join(bodies)}</body>
</worldbody><actuator>{"".join(motors)}</actuator></mujoco>"""

    def foot_position(self, leg, joints):
        """Foot of a leg from its first joint (m), trunk axes."""
        foot = np.zeros(3)
        for link, axis, angle in zip(
            self.links[leg][::-1], self.axes[leg][::-1], joints[::-1], strict=True
        ):
            foot = turned(axis, angle, link + foot)
        return foot

    def foot_jacobian(self, leg, joints):
        """d foot_position / d joints, 3 x 3, by central differences."""
        step = 1e-6 * np.eye(3)
        columns = [
            self.foot_position(leg, joints + d) - self.foot_position(leg, joints - d) for d in step
        ]
        return np.array(columns).T / 2e-6

    def bent(self, leg):
        """A posture with the foot below the hip joint and the knee bent backwards."""
        limits = self.joint_limit_rad[3 * leg : 3 * leg + 3]
        best = None
        for thigh in np.linspace(*np.clip(limits[1], -2.4, 2.4), 61):
            for knee in np.linspace(*np.clip(limits[2], -2.4, 2.4), 61):
                joints = np.array([0.0, thigh, knee])
                foot = self.foot_position(leg, joints)
                knee_x = self.knee_x(leg, joints)
                cost = abs(foot[0]) + abs(foot[2] + 0.64 * self.leg_m) + (1.0 if knee_x > 0 else 0)
                if best is None or cost < best[0]:
                    best = (cost, joints)
        return best[1]

    def knee_x(self, leg, joints):
        """How far the knee is in front of the line from hip to foot, about (m)."""
        axes, links = self.axes[leg], self.links[leg]
        knee = turned(axes[0], joints[0], turned(axes[1], joints[1], links[1]))
        return knee[0]

    def joints_for_foot(self, leg, foot):
        """Joint angles that put the foot there, by Newton's method from the bent posture; places
        out of reach are moved into it."""
        foot = np.array(foot, float)
        straight = np.linalg.norm(foot - [0.0, self.hip_offset_m[leg], 0.0])
        reach = 0.95 * self.leg_m
        if straight > reach:
            foot = [0.0, self.hip_offset_m[leg], 0.0] + (
                foot - [0.0, self.hip_offset_m[leg], 0.0]
            ) * (reach / straight)
        joints = self.seeds[leg].copy()
        for _ in range(30):
            miss = foot - self.foot_position(leg, joints)
            jacobian = self.foot_jacobian(leg, joints)
            square = jacobian.T @ jacobian + 1e-6 * self.leg_m**2 * np.eye(3)
            joints = joints + np.clip(np.linalg.solve(square, jacobian.T @ miss), -0.3, 0.3)
            if np.abs(miss).max() < 1e-7:
                break
        limits = self.joint_limit_rad[3 * leg : 3 * leg + 3]
        return np.clip(joints, limits[:, 0], limits[:, 1])

    def standing_joints(self, height_m):
        """(12,) joint angles with the feet below the hips and a level trunk this high."""
        angles = []
        for leg in range(4):
            down = height_m - self.foot_radius_m + self.hip_position_m[leg][2]
            angles.append(self.joints_for_foot(leg, (0.0, self.hip_offset_m[leg], -down)))
        return np.concatenate(angles)


class ScaledController(jump_controller.JumpController):
    """The jump of `jump_controller` with gains in flight for a robot of another size."""

    def _follow(self, joint_reference):
        robot, body = self.robot, self.body
        scale = robot.mass_kg * robot.leg_m**2 / (GO1_MASS_KG * GO1_LEG_M**2)
        stiffness, damping = (scale * gain for gain in jump_controller.FLIGHT_GAINS)
        position, velocity, _ = joint_reference
        return stiffness * (position - body.joints) + damping * (velocity - body.joint_rates)


def axis_of(joint):
    """Axis of a joint as a vector."""
    axis = joint["axis"]
    if isinstance(axis, str):
        named = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}[axis[-1]]
        axis = -np.array(named) if axis.startswith("-") else np.array(named)
    return np.array(axis, float)


def turned(axis, angle, vector):
    """A vector turned about a unit axis."""
    cosine, sine = np.cos(angle), np.sin(angle)
    along = axis * (axis @ vector) * (1.0 - cosine)
    return vector * cosine + np.cross(axis, vector) * sine + along


def numbers(vector):
    return " ".join(repr(float(value)) for value in vector)


def plan_of(robot, random, effort):
    """A jump drawn at random, scaled from a Go1's; less effort crouches and pushes less."""
    size = robot.leg_m / GO1_LEG_M
    speed = np.sqrt(size)

    def draw(low, high, by=size):
        return by * random.uniform(low, high)

    stand_m = draw(0.262, 0.285)
    return replace(
        jump_controller.JumpPlan(),
        stand_height_m=stand_m,
        crouch_height_m=stand_m - effort * draw(0.065, 0.09),
        crouch_shift_m=draw(-0.03, 0.01),
        takeoff_height_m=draw(0.305, 0.320),
        takeoff_velocity=(draw(0.2, 0.8, effort * speed), 0.0, draw(1.0, 1.3, effort * speed)),
        takeoff_pitch_rate=draw(-0.2, 0.2, 1.0),
        crouch_duration_s=draw(0.30, 0.42, speed),
        hold_s=draw(0.02, 0.06, 1.0),
        tuck_m=draw(0.02, 0.05),
        landing_leg_m=draw(0.27, 0.29),
        landing_reach_s=draw(0.07, 0.10, speed),
        landing_duration_s=draw(0.34, 0.44, speed),
        final_height_m=draw(0.25, 0.27),
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robot", type=pathlib.Path, help="TOML or URDF")
    parser.add_argument("--out-dir", type=pathlib.Path, required=True)
    parser.add_argument("--romc", default="romc", help="the program")
    parser.add_argument("--jumps", type=int, default=12)
    parser.add_argument("--effort", type=float, default=1.0, help="below 1 for weak motors")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    shown = subprocess.run(
        [arguments.romc, "robot", arguments.robot, "--json"], check=True, capture_output=True
    )
    robot = DescribedRobot(json.loads(shown.stdout)["robot"])
    arguments.out_dir.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(arguments.seed)
    jump, failed = 1, 0
    while jump <= arguments.jumps:
        plan = plan_of(robot, random, arguments.effort)
        simulation = Simulation(robot)
        simulation.reset(robot.standing_joints(plan.stand_height_m), plan.stand_height_m)
        controller = ScaledController(robot, plan, start_s=WARMUP_S)
        log = simulation.run(controller, WARMUP_S + LONGEST_S)
        log = log.between(WARMUP_S, controller.rest_s(WARMUP_S + LONGEST_S))
        first, last = longest_flight(log.feet())
        flight_s = log.time_s[last] - log.time_s[first]
        upright = np.abs(log.x[:, 15:17]).max() < 0.5
        apex, way = log.x[:, 14].max(), log.x[-1, 12]
        print(
            f"jump_{jump:02}: {len(log.time_s)} rows, in the air {flight_s:.3f} s, apex {apex:.3f} m, "
            f"{way:+.3f} m ahead, roll and pitch to {np.abs(log.x[:, 15:17]).max():.2f} rad"
        )
        if flight_s < 0.12 or not upright or log.other_contact.any():
            print(f"jump_{jump:02}: no jump that lands on its feet, drawn anew")
            failed += 1
            if failed > arguments.jumps:
                raise SystemExit("more than half of the jumps do not land: try less --effort")
            continue
        path = arguments.out_dir / f"jump_{jump:02}.csv.gz"
        write_recording(path, log.time_s, log.x, log.dx, log.torque_nm, log.feet())
        jump += 1


if __name__ == "__main__":
    main()
