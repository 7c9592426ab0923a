"""Compares the closed-form leg kinematics with MuJoCo, and -J^-T tau with contact forces.

Frames: the foot position is measured from the hip (on the abduction axis) along
the trunk's axes; forces of the closed form are in those axes too and are turned
into the world to be compared.
"""

import mujoco
import numpy as np

from jump_controller import JumpController, JumpPlan
from robot_model import LEGS
from simulation import Simulation, write_state

SAMPLES = 200


def kinematics_report(robot):
    """(faults, text) for one robot."""
    position_error, jacobian_error = geometry_errors(robot)
    standing, force = force_agreement(robot)
    weight = 9.81 * robot.mass_kg
    forward, down = robot.foot_in_calf_m
    hips = zip(LEGS, robot.hip_position_m.tolist(), strict=True)
    offsets = zip(LEGS, robot.hip_offset_m, strict=True)
    lines = [
        f"{robot.name}: {robot.mass_kg:.3f} kg, torque limits {robot.torque_limit_nm[:3]} N m",
        f"  joint limits fr {robot.joint_limit_rad[:3].round(4).tolist()} rad",
        f"  joint limits rr {robot.joint_limit_rad[6:9].round(4).tolist()} rad",
        "  hips in the trunk frame (m): " + ", ".join(f"{leg} {place}" for leg, place in hips),
        "  hip offset y (m): " + ", ".join(f"{leg} {y:+.4f}" for leg, y in offsets),
        f"  thigh {robot.thigh_m} m, foot in the calf frame ({forward}, 0, -{down}) m, "
        f"foot radius {robot.foot_radius_m} m",
        f"  foot position, closed form against MuJoCo: at most {position_error:.1e} m apart "
        f"({SAMPLES} random postures)",
        f"  foot Jacobian: at most {jacobian_error:.1e} m/rad apart",
        f"  weight {weight:.2f} N",
    ]
    lines += [f"  {line}" for line in force]
    faults = []
    if position_error > 1e-9 or jacobian_error > 1e-9:
        faults.append(f"{robot.name}: closed-form kinematics differ from MuJoCo's")
    if abs(standing / weight - 1.0) > 0.3:
        faults.append(f"{robot.name}: -J^-T tau does not carry the weight when standing")
    return faults, "\n".join(lines)


def geometry_errors(robot):
    """Largest differences of foot positions and Jacobians over random postures."""
    data = mujoco.MjData(robot.mj)
    random = np.random.default_rng(0)
    low, high = robot.joint_limit_rad.T
    worst = np.zeros(2)
    full = np.zeros((3, robot.mj.nv))
    for _ in range(SAMPLES):
        mujoco.mj_resetData(robot.mj, data)
        joints = random.uniform(low, high)
        data.qpos[robot.qpos_index] = joints
        data.qpos[3:7] = random.standard_normal(4)
        mujoco.mj_forward(robot.mj, data)
        turn = data.xmat[robot.trunk_body].reshape(3, 3)
        for leg in range(4):
            angles = joints[3 * leg : 3 * leg + 3]
            foot = turn.T @ (data.geom_xpos[robot.foot_geom[leg]] - data.xpos[robot.trunk_body])
            foot -= robot.hip_position_m[leg]
            worst[0] = max(worst[0], np.abs(foot - robot.foot_position(leg, angles)).max())
            point = data.geom_xpos[robot.foot_geom[leg]]
            mujoco.mj_jac(robot.mj, data, full, None, point, robot.foot_body[leg])
            joint_part = turn.T @ full[:, robot.dof_index[3 * leg : 3 * leg + 3]]
            worst[1] = max(worst[1], np.abs(joint_part - robot.foot_jacobian(leg, angles)).max())
    return worst


def force_agreement(robot):
    """(vertical sum standing still, sentences) of -J^-T tau against the floor's force."""
    plan = JumpPlan()
    simulation = Simulation(robot)
    simulation.reset(robot.standing_joints(plan.stand_height_m), plan.stand_height_m)
    controller = JumpController(robot, plan, start_s=0.3)
    log = simulation.run(controller, 1.2)
    still = np.searchsorted(log.time_s, 0.29)
    thrust_s = 0.3 + plan.hold_s + plan.crouch_duration_s + plan.hold_s
    push = (log.time_s > thrust_s) & log.feet().all(axis=1) & (log.time_s < thrust_s + 0.3)
    floor = log.foot_force_n.sum(axis=1)
    damping = robot.mj.dof_damping[robot.dof_index] * log.dx[:, :12]
    guess = body_forces(robot, log, log.torque_nm)
    standing = guess[still, 2]
    lines = [f"standing: sum of vertical -J^-T tau {standing:.2f} N"]
    for name, torque in (
        ("tau", log.torque_nm),
        ("(tau - joint damping)", log.torque_nm - damping),
    ):
        guess = body_forces(robot, log, torque)[push]
        mean, real = guess.mean(axis=0), floor[push].mean(axis=0)
        error = np.sqrt(((guess - floor[push]) ** 2).mean(axis=0))
        lines.append(
            f"thrust, sum of -J^-T {name}: mean x {mean[0]:.1f}, z {mean[2]:.1f} N; "
            f"the floor gives x {real[0]:.1f}, z {real[2]:.1f} N; "
            f"rms difference x {error[0]:.1f}, z {error[2]:.1f} N"
        )
    return standing, lines


def body_forces(robot, log, torque):
    """(rows, 3) sums over the legs of -J^-T tau in the world frame."""
    return np.array(
        [leg_forces(robot, x, tau).sum(axis=0) for x, tau in zip(log.x, torque, strict=True)]
    )


def leg_forces(robot, x, torque):
    """(4, 3) world forces of the legs on the body, -J^-T tau each, at a measured state."""
    data = mujoco.MjData(robot.mj)
    write_state(robot, data, x)
    mujoco.mj_kinematics(robot.mj, data)
    turn = data.xmat[robot.trunk_body].reshape(3, 3)
    forces = np.zeros((4, 3))
    for leg in range(4):
        joints = slice(3 * leg, 3 * leg + 3)
        jacobian = robot.foot_jacobian(leg, x[joints])
        forces[leg] = turn @ -np.linalg.solve(jacobian.T, torque[joints])
    return forces
