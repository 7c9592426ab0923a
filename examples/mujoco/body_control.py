"""From a wanted motion of the body to joint torques of the legs that stand.

The wanted acceleration of the centre of mass and of the trunk's attitude is a
wrench; the feet on the floor share it by non-negative least squares over the
edges of their friction pyramids; torques are J^T f plus the legs' own weight
and joint damping. All kinematics come from the measured state alone.
"""

import mujoco
import numpy as np
from scipy.optimize import nnls

from simulation import write_state

GRAVITY = np.array([0.0, 0.0, -9.81])
FORCE_REGULARISATION = 2e-3
WRENCH_WEIGHTS = (1, 1, 1, 8, 8, 8)


class BodyControl:
    """Kinematics and force distribution for one robot, fed with measured states."""

    def __init__(self, robot, friction_share=0.65):
        self.robot = robot
        self.data = mujoco.MjData(robot.mj)
        slope = friction_share * robot.friction
        self.edges = np.array([[slope, 0, 1], [-slope, 0, 1], [0, slope, 1], [0, -slope, 1]]).T

    def update(self, x, dx):
        """Sets the measured state; fills the properties below (world frame)."""
        robot, data = self.robot, self.data
        write_state(robot, data, x, dx)
        mujoco.mj_fwdPosition(robot.mj, data)
        mujoco.mj_fwdVelocity(robot.mj, data)
        mujoco.mj_subtreeVel(robot.mj, data)
        self.joints, self.joint_rates = x[:12], dx[:12]
        self.com = data.subtree_com[robot.trunk_body].copy()
        self.com_velocity = data.subtree_linvel[robot.trunk_body].copy()
        self.trunk = x[12:15]
        self.rpy = x[15:]
        self.rotation = data.xmat[robot.trunk_body].reshape(3, 3).copy()
        self.omega = self.rotation @ data.qvel[3:6]
        self.feet = data.geom_xpos[robot.foot_geom].copy()
        self.inertia = _inertia(data.crb[robot.trunk_body])

    def joint_inertia(self):
        """(12, 12) mass matrix of the joints, the trunk held."""
        full = np.zeros((self.robot.mj.nv, self.robot.mj.nv))
        mujoco.mj_fullM(self.robot.mj, self.data, full)
        return full[np.ix_(self.robot.dof_index, self.robot.dof_index)]

    def wrench_for(self, acceleration, angular_acceleration):
        """Force and moment about the centre of mass that the floor must give (6,)."""
        force = self.robot.mass_kg * (acceleration - GRAVITY)
        moment = self.inertia @ angular_acceleration
        return np.concatenate([force, moment])

    def foot_forces(self, wrench, stance, weights=WRENCH_WEIGHTS, effort=(1, 1, 1, 1)):
        """(4, 3) floor forces of the standing feet that give the wrench, inside the pyramids.

        If the wrench cannot be produced exactly, the error is distributed according to
        `weights`; feet of greater `effort` are used less.
        """
        legs = np.flatnonzero(stance)
        if len(legs) == 0:
            return np.zeros((4, 3))
        columns = []
        for leg in legs:
            arm = self.feet[leg] - self.com
            for edge in self.edges.T:
                columns.append(np.concatenate([edge, np.cross(arm, edge)]))
        weight = np.array(weights, dtype=float)
        matrix = weight[:, None] * np.array(columns).T
        scale = np.sqrt(FORCE_REGULARISATION) * np.diag(np.repeat(np.array(effort, float)[legs], 4))
        target = np.concatenate([weight * wrench, np.zeros(len(scale))])
        share, _ = nnls(np.vstack([matrix, scale]), target)
        forces = np.zeros((4, 3))
        for index, leg in enumerate(legs):
            forces[leg] = self.edges @ share[4 * index : 4 * index + 4]
        return forces

    def torques_for(self, forces):
        """(12,) joint torques that press the feet on the floor with minus `forces`."""
        robot, data = self.robot, self.data
        torque = (
            data.qfrc_bias[robot.dof_index]
            + robot.mj.dof_damping[robot.dof_index] * self.joint_rates
        )
        jacobian = np.zeros((3, robot.mj.nv))
        for leg in range(4):
            if not forces[leg].any():
                continue
            mujoco.mj_jac(robot.mj, data, jacobian, None, self.feet[leg], robot.foot_body[leg])
            joints = slice(3 * leg, 3 * leg + 3)
            torque[joints] -= jacobian[:, robot.dof_index[joints]].T @ forces[leg]
        return torque


def _inertia(crb):
    xx, yy, zz, xy, xz, yz = crb[:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
