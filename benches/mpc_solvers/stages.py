"""The structured solver and PIQP on the same problems: closed loops of an MPC with limits active in most steps.

    python -m venv venv && venv/bin/pip install -r benches/mpc_solvers/requirements.txt
    venv/bin/python benches/mpc_solvers/stages.py --out-dir problems --dims 4 6 --horizons 20 --seed 1
    venv/bin/python benches/mpc_solvers/stages.py problems/*.bin          # files that are there already

Makes the files that `cargo bench --bench structured` documents, unless some are given, runs that program on each, and PIQP
(its multistage and its sparse factorisation, unknowns in the order of the stages, tolerance 1e-6) on the same problems
right after; prints median and 99th percentile of both, CPU time, and their ratios. Both run each loop three times, and a
step's time is its smallest: a 99th percentile of 300 steps is the third worst, which the machine's other work would decide.
"""

import argparse
import pathlib
import struct
import subprocess
import time

import numpy as np
import piqp
from scipy import sparse

REPEATS = 3  # of each loop, as in benches/structured.rs
STEP_S = 0.01
TORQUE = np.array([23.7, 23.7, 35.55] * 4)
LOW, HIGH = np.array([-0.86, -0.69, -2.82] * 4), np.array([0.86, 4.5, -0.89] * 4)
STAND = np.array([0.0, 0.9, -1.8] * 4)
FRICTION = 0.6
ROOT = pathlib.Path(__file__).resolve().parents[2]


class Loop:
    """Data common to all steps of a file."""

    def __init__(self, lift, decoder, weights):
        self.lift, self.decoder = lift, decoder
        self.position, self.velocity, self.input, self.terminal = weights

    def pack(self):
        parts = (self.lift, self.decoder, STAND, LOW, HIGH, TORQUE, [FRICTION])
        parts += (self.position, self.velocity, self.input, [self.terminal])
        return b"".join(np.ascontiguousarray(part, "<f8").tobytes() for part in parts)


def random_loop(d, rng):
    """A lift that holds the robot's weight by its first input, a decoder, weights."""
    lift = rng.normal(size=(d, 18)) * np.r_[np.full(12, 16.0 / np.sqrt(d)), np.full(6, 10.0)]
    lift[:, 14] = 12.0 * rng.normal(size=d)
    lift[0, 12:15] = 5.0, -3.0, 100.0
    decoder = 0.35 * rng.normal(size=(12, d)) / np.sqrt(d)
    return Loop(lift, decoder, (np.full(d, 150.0), np.full(d, 1.5), np.full(d, 0.08), 8.0))


def random_stages(d, horizon, steps, rng):
    """Discrete dynamics along a motion, linearised: stiffness and coupling swing with time."""
    stiffness, damping = -rng.uniform(10, 35, d), -rng.uniform(2, 7, d)
    coupling = rng.normal(size=(d, d)) * (rng.random((d, d)) < 0.4)
    gain = 35.0 * (np.eye(d) * rng.uniform(0.8, 1.2, d) + 0.15 * rng.normal(size=(d, d)))
    stages = []
    for k in range(steps + horizon):
        swing = np.sin(9.0 * STEP_S * k + np.arange(d))
        rate = np.zeros((3 * d, 3 * d))
        rate[:d, d : 2 * d] = np.eye(d)
        rate[d : 2 * d, :d] = np.diag(stiffness * (1 + 0.3 * swing)) + 3.0 * coupling * swing
        rate[d : 2 * d, d : 2 * d] = np.diag(damping) + 0.3 * coupling
        rate[d : 2 * d, 2 * d :] = gain
        power, step = np.eye(3 * d), np.eye(3 * d)
        for order in range(1, 5):
            power = power @ rate * STEP_S / order
            step = step + power
        drift = step[: 2 * d, 2 * d :] @ np.linalg.solve(gain, -9.81 * np.eye(d)[0])
        stages.append((step[: 2 * d, : 2 * d], step[: 2 * d, 2 * d :], drift))
    return stages


def reference(d, count, height, rng):
    """Jumps, one every 0.8 s, each of another size."""
    s = STEP_S * np.arange(count) / 0.8
    sizes = rng.uniform(0.4, 1.2, int(s[-1]) + 2)[s.astype(int)]
    phase = 2 * np.pi * (s % 1.0)
    shape = -0.6 * np.sin(phase) + 0.5 * np.sin(2 * phase) * (s % 1.0 > 0.3)
    mix = np.r_[1.0, rng.uniform(-0.5, 0.5, d - 1)]
    z = height * sizes[:, None] * shape[:, None] * mix
    return np.hstack([z, np.gradient(z, STEP_S, axis=0)])


class Problem:
    """The stages' program for PIQP; unknowns x_0, v_0, x_1, ..., x_N."""

    def __init__(self, loop, d, horizon):
        self.d, self.horizon, self.width = d, horizon, 3 * d
        self.n = horizon * self.width + 2 * d
        state = np.r_[loop.position, loop.velocity]
        blocks = [np.r_[state, loop.input]] * horizon + [loop.terminal * state]
        self.diagonal = 2 * np.concatenate(blocks)
        force = loop.lift[:, 12:15]
        friction = np.array([s * force[:, a] - FRICTION * force[:, 2] for a in (0, 1) for s in (1, -1)])
        inputs = np.vstack([loop.lift[:, :12].T, friction])
        joints = np.hstack([loop.decoder, np.zeros((12, d))])
        rows = [sparse.csc_matrix((0, self.n))]
        lower, upper = [], []
        for k in range(horizon):
            for block, low, high, first in (
                (inputs, np.r_[-TORQUE, np.full(4, -np.inf)], np.r_[TORQUE, np.zeros(4)], k * self.width + 2 * d),
                (joints, LOW - STAND, HIGH - STAND, (k + 1) * self.width),
            ):
                matrix = sparse.lil_matrix((len(block), self.n))
                matrix[:, first : first + block.shape[1]] = block
                rows.append(matrix.tocsc())
                lower.append(low)
                upper.append(high)
        self.rows = sparse.vstack(rows, format="csc")
        self.lower, self.upper = np.concatenate(lower), np.concatenate(upper)

    def cost(self, target):
        linear = np.zeros(self.n)
        for k in range(self.horizon + 1):
            at = slice(k * self.width, k * self.width + 2 * self.d)
            linear[at] = -self.diagonal[at] * target[k]
        return linear

    def value(self, states, inputs, target):
        """The cost of a plan."""
        off = np.hstack([states[:-1] - target[:-1], inputs]).ravel()
        return 0.5 * (self.diagonal * np.r_[off, states[-1] - target[-1]] ** 2).sum()

    def dynamics(self, x0, stages):
        d, width = self.d, self.width
        row, col, value, right = [], [], [], [x0]
        eye = np.arange(2 * d)
        row.append(eye)
        col.append(eye)
        value.append(np.ones(2 * d))
        grid_r, grid_c = np.meshgrid(eye, np.arange(3 * d), indexing="ij")
        for k, (a, b, c) in enumerate(stages):
            first = 2 * d * (k + 1)
            row += [first + grid_r.ravel(), first + eye]
            col += [k * width + grid_c.ravel(), (k + 1) * width + eye]
            value += [np.hstack([a, b]).ravel(), -np.ones(2 * d)]
            right.append(-c)
        entries = (np.concatenate(value), (np.concatenate(row), np.concatenate(col)))
        shape = (2 * d * (self.horizon + 1), self.n)
        return sparse.csc_matrix(entries, shape=shape), np.concatenate(right)


class Piqp:
    """One solver that keeps its pattern; times in us."""

    def __init__(self, problem, factorisation, tolerance):
        self.problem, self.solver, self.is_set_up, self.unsolved = problem, piqp.SparseSolver(), False, 0
        settings = self.solver.settings
        settings.eps_abs = settings.eps_rel = tolerance
        settings.kkt_solver = factorisation

    def solve(self, x0, stages, target):
        problem = self.problem
        linear = problem.cost(target)
        matrix, right = problem.dynamics(x0, stages)
        started = time.thread_time()
        if self.is_set_up:
            self.solver.update(c=linear, A=matrix, b=right)
        else:
            cost = sparse.diags(problem.diagonal, format="csc")
            self.solver.setup(cost, linear, matrix, right, problem.rows, problem.lower, problem.upper)
            self.is_set_up = True
        self.unsolved += self.solver.solve() != piqp.PIQP_SOLVED
        spent = 1e6 * (time.thread_time() - started)
        y = self.solver.result.x.copy()
        inner = y[: problem.horizon * problem.width].reshape(problem.horizon, problem.width)
        states = np.vstack([inner[:, : 2 * problem.d], y[-2 * problem.d :]])
        return states, inner[:, 2 * problem.d :], spent


def closed_loop(path, d, horizon, steps, seed):
    """Writes a file; the share of steps in which some limit is active somewhere in the plan."""
    rng = np.random.default_rng(seed)
    loop = random_loop(d, rng)
    stages = random_stages(d, horizon, steps, rng)
    target = reference(d, steps + horizon + 1, 0.3, rng)
    problem = Problem(loop, d, horizon)
    solver = Piqp(problem, piqp.KKTSolver.sparse_multistage, 1e-9)
    x, active = target[0].copy(), 0
    with open(path, "wb") as file:
        file.write(struct.pack("<4i", d, horizon, steps, 0) + loop.pack())
        for k in range(steps):
            window, wanted = stages[k : k + horizon], target[k : k + horizon + 1]
            states, inputs, _ = solver.solve(x, window, wanted)
            cost = ((states - wanted) ** 2).sum()
            for part in (x, wanted, *(np.array([stage[i] for stage in window]) for i in range(3)), states, inputs, states, inputs, [cost]):
                file.write(np.ascontiguousarray(part, "<f8").tobytes())
            lifted = inputs @ loop.lift[:, :15]
            torque = (np.abs(lifted[:, :12]) > TORQUE - 1e-3).any()
            friction = (np.abs(lifted[:, 12:14]).max(axis=1) > FRICTION * lifted[:, 14] - 1e-2).any()
            active += bool(torque or friction)
            noise = rng.normal(size=2 * d) * np.r_[np.full(d, 1e-3), np.full(d, 2e-2)]
            x = window[0][0] @ x + window[0][1] @ inputs[0] + window[0][2] + noise
    return active / steps


def read(path):
    """The shared part, dimensions, and an iterator over (x0, stages, target) and the solution's states and inputs."""
    data = path.read_bytes()
    d, horizon, steps, _ = struct.unpack("<4i", data[:16])
    values = np.frombuffer(data, "<f8", offset=16)
    at = 0

    def take(*shape):
        nonlocal at
        count = int(np.prod(shape))
        at += count
        return values[at - count : at].reshape(shape)

    global STAND, LOW, HIGH, TORQUE, FRICTION
    lift, decoder = take(d, 18), take(12, d)
    STAND, LOW, HIGH, TORQUE = take(12), take(12), take(12), take(12)
    FRICTION = float(take(1)[0])
    loop = Loop(lift, decoder, (take(d), take(d), take(d), float(take(1)[0])))
    first = at

    def all_steps():
        nonlocal at
        at = first
        for _ in range(steps):
            x0, target = take(2 * d), take(horizon + 1, 2 * d)
            a, b, c = take(horizon, 2 * d, 2 * d), take(horizon, 2 * d, d), take(horizon, 2 * d)
            take((horizon + 1) * 2 * d + horizon * d)
            states, inputs, _ = take(horizon + 1, 2 * d), take(horizon, d), take(1)
            yield (x0, list(zip(a, b, c)), target), (states, inputs)

    return loop, d, horizon, all_steps


def compare(path):
    times = path.with_suffix(".times")
    command = ["cargo", "bench", "--quiet", "--bench", "structured", "--", str(path.resolve()), "--times", str(times.resolve())]
    subprocess.run(command, cwd=ROOT, check=True)
    ours = np.loadtxt(times)[1:]
    loop, d, horizon, all_steps = read(path)
    problem = Problem(loop, d, horizon)
    kinds = {"multistage": piqp.KKTSolver.sparse_multistage, "sparse": piqp.KKTSolver.sparse_ldlt}
    best = None
    for name, kind in kinds.items():
        found, worst = [], 0.0
        for _ in range(REPEATS):
            solver = Piqp(problem, kind, 1e-6)
            found.append([])
            for step, solution in all_steps():
                states, inputs, spent = solver.solve(*step)
                found[-1].append(spent)
                value, best_value = (problem.value(*plan, step[2]) for plan in ((states, inputs), solution))
                worst = max(worst, abs(value - best_value) / max(best_value, 1.0))
        ranks = np.percentile(np.min(found, axis=0)[1:], [50, 99])
        times = f"median {ranks[0]:.0f} us, 99 % {ranks[1]:.0f} us"
        print(f"  PIQP {name}: {times}; cost within {worst:.1e} of its own at 1e-9; {solver.unsolved} unsolved")
        best = ranks if best is None else np.minimum(best, ranks)
    ratio = best / np.percentile(ours, [50, 99])
    print(f"  faster than the best of PIQP by {ratio[0]:.1f} (median), {ratio[1]:.1f} (99 %)")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=pathlib.Path)
    parser.add_argument("--out-dir", type=pathlib.Path, default=pathlib.Path("problems"))
    parser.add_argument("--dims", nargs="+", type=int, default=[4, 6])
    parser.add_argument("--horizons", nargs="+", type=int, default=[20])
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    files = arguments.files
    if not files:
        arguments.out_dir.mkdir(parents=True, exist_ok=True)
        for d in arguments.dims:
            for horizon in arguments.horizons:
                path = arguments.out_dir / f"d{d}_n{horizon}_seed{arguments.seed}.bin"
                share = closed_loop(path, d, horizon, arguments.steps, arguments.seed)
                print(f"{path}: some limit active in {100 * share:.0f} % of the steps")
                files.append(path)
    for path in files:
        compare(path)


if __name__ == "__main__":
    main()
