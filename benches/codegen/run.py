"""Times romc's generated code against that of CasADi, SymForce, SymPy and SymEngine."""

import argparse
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import models

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
REQUIREMENTS = {
    "casadi": ["casadi==3.8.0"],
    "sympy": ["sympy==1.14.0"],
    "symengine": ["symengine==0.15.0", "sympy==1.14.0"],
    "symforce": ["symforce==0.12.0"],
}
PEERS = ["casadi", "symforce", "symforce_rust", "sympy", "symengine"]
FLAGS = {"-O3 -march=native": "-C opt-level=3 -C target-cpu=native", "-O2": "-C opt-level=2"}
ROUNDS = 40


def call(command, **options):
    return subprocess.run(command, check=True, **options)


def environment(work, peer):
    """The interpreter of a peer's own environment, made at the first use."""
    name = peer.removesuffix("_rust")
    python = work / "env" / name / "bin" / "python"
    if not python.exists():
        print(f"installing {' '.join(REQUIREMENTS[name])}", file=sys.stderr)
        call([sys.executable, "-m", "venv", work / "env" / name])
        call([python, "-m", "pip", "-q", "install", *REQUIREMENTS[name]])
    return python


def measured(command, **options):
    """CPU milliseconds and peak resident megabytes of a process with its children."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, **options)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{command}: status {status}")
    return 1e3 * (usage.ru_utime + usage.ru_stime), usage.ru_maxrss / 1024


def emit(work, romc, name, model):
    """Sources of all peers and of romc; returns the compilers' cost."""
    folder = work / name
    folder.mkdir(parents=True, exist_ok=True)
    cost = {}
    # The same stem for everyone: the model's name becomes part of each function's name.
    source = folder / "model.json"
    source.write_text(json.dumps(model))
    for peer in PEERS:
        command = [environment(work, peer), HERE / "peers.py", peer, source, folder]
        cost[peer] = measured(command, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})
    own = folder / "romc.json"
    own.write_text(json.dumps(models.romc_model("ours", model)))
    command = [romc, "compile", own, "--emit", "c,rust", "--out-dir", folder / "romc", "--force"]
    cost["romc"] = measured(command)
    return folder, cost


def driver(d, nnz):
    """A C program that times every function in turn, round after round."""
    c_peers = [peer for peer in PEERS]
    declare = "".join(
        f"void {p}_model(const double*,const double*,const double*,double*);"
        f"void {p}_model_jac(const double*,const double*,const double*,double*,double*);\n"
        for p in c_peers
    )
    rows = [(p, f"{p}_model", f"{p}_model_jac") for p in c_peers]
    rows.append(("romc", "ours_phase_dynamics", "ours_phase_dynamics_jacobian"))
    rows.append(("romc_rust", "romc_rust", "romc_rust_jac"))
    declare += (
        "void romc_rust(const double*,const double*,const double*,double*);"
        "void romc_rust_jac(const double*,const double*,const double*,double*,double*);\n"
        "void romc_rust_batch(size_t,const double*,const double*,const double*,double*);\n"
    )
    table = ",".join(f'{{"{n}",{a},{b}}}' for n, a, b in rows)
    return f"""#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "romc/ours.h"
{declare}
#define D {d}
#define N 4096
#define B 512
typedef void one(const double*,const double*,const double*,double*);
typedef void two(const double*,const double*,const double*,double*,double*);
typedef void many(size_t,const double*,const double*,const double*,double*);
static struct {{ const char *name; one *ddz; two *jac; }} rows[] = {{{table}}};
static struct {{ const char *name; many *batch; }} batches[] =
    {{{{"romc", ours_phase_dynamics_batch}}, {{"romc_rust", romc_rust_batch}}}};
enum {{ R = sizeof rows / sizeof *rows }};
static double z[N*D], dz[N*D], u[N*D], ddz[N*D], jac[{max(nnz, 1)}], reference[N*D], best[R][2], best_batch[2];
static double now(void) {{ struct timespec t; clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t); return 1e9*(double)t.tv_sec + (double)t.tv_nsec; }}
static double uniform(void) {{ return 4.0*rand()/RAND_MAX - 2.0; }}
int main(void) {{
    for (int i = 0; i < N*D; ++i) {{ z[i] = uniform(); dz[i] = uniform(); u[i] = uniform(); }}
    for (int r = 0; r < R; ++r) {{
        best[r][0] = best[r][1] = 1e18;
        for (int i = 0; i < N; ++i) rows[r].jac(z + D*i, dz + D*i, u + D*i, ddz + D*i, jac);
        for (int i = 0; i < N*D; ++i) {{
            if (r == 0) reference[i] = ddz[i];
            if (!(fabs(ddz[i] - reference[i]) <= 1e-9*(1.0 + fabs(reference[i])))) {{ printf("%s differs: %g %g\\n", rows[r].name, ddz[i], reference[i]); return 1; }}
        }}
    }}
    best_batch[0] = best_batch[1] = 1e18;
    for (int round = 0; round < {ROUNDS}; ++round) {{
        for (int r = 0; r < R; ++r) {{
            double start = now();
            for (int i = 0; i < N; ++i) rows[r].ddz(z + D*i, dz + D*i, u + D*i, ddz + D*i);
            double time = (now() - start)/N;
            if (time < best[r][0]) best[r][0] = time;
            start = now();
            for (int i = 0; i < N; ++i) rows[r].jac(z + D*i, dz + D*i, u + D*i, ddz + D*i, jac);
            time = (now() - start)/N;
            if (time < best[r][1]) best[r][1] = time;
        }}
        for (int r = 0; r < 2; ++r) {{
            double start = now();
            for (int i = 0; i < N; i += B) batches[r].batch(B, z + D*i, dz + D*i, u + D*i, ddz + D*i);
            double time = (now() - start)/N;
            if (time < best_batch[r]) best_batch[r] = time;
        }}
    }}
    for (int r = 0; r < R; ++r) printf("%s %.2f %.2f\\n", rows[r].name, best[r][0], best[r][1]);
    for (int r = 0; r < 2; ++r) printf("%s_batch %.2f 0\\n", batches[r].name, best_batch[r]);
    return 0;
}}
"""


def rust_shim(d, nnz):
    """C entry points to romc's Rust crate."""
    array = f"&*(%s as *const [f64; {d}])"
    arguments = ", ".join(array % v for v in ("z", "dz", "u"))
    pointers = "z: *const f64, dz: *const f64, u: *const f64, ddz: *mut f64"
    slices = ", ".join(f"core::slice::from_raw_parts({v}, n * {d})" for v in ("z", "dz", "u"))
    return f"""
#[no_mangle] pub unsafe extern "C" fn romc_rust({pointers}) {{ ours::phase_dynamics({arguments}, &mut *(ddz as *mut [f64; {d}])) }}
#[no_mangle] pub unsafe extern "C" fn romc_rust_jac({pointers}, jac: *mut f64) {{ ours::phase_dynamics_jacobian({arguments}, &mut *(ddz as *mut [f64; {d}]), &mut *(jac as *mut [f64; {nnz}])) }}
#[no_mangle] pub unsafe extern "C" fn romc_rust_batch(n: usize, {pointers}) {{ ours::phase_dynamics_batch(n, {slices}, core::slice::from_raw_parts_mut(ddz, n * {d})) }}
"""


def time_code(folder, model, flags):
    """Nanoseconds of `ddz` and of `ddz` with Jacobian by each peer."""
    header = (folder / "romc" / "ours.h").read_text()
    nnz = int(re.search(r"JACOBIAN_NNZ (\d+)", header)[1])
    rust = FLAGS[flags].split()
    (folder / "driver.c").write_text(driver(model["d"], nnz))
    shim = "#![allow(warnings)]\n" + (folder / "symforce_rust_model.rs").read_text() + rust_shim(model["d"], nnz)
    (folder / "shim.rs").write_text(shim)
    crate = folder / "romc" / "ours" / "src" / "lib.rs"
    edition = ["rustc", "--edition", "2021", *rust]
    call([*edition, "--cfg", 'feature="std"', "--crate-type", "rlib", "--crate-name", "ours", crate, "-o", folder / "libours.rlib"])
    call([*edition, "--crate-type", "staticlib", "--extern", f"ours={folder / 'libours.rlib'}", folder / "shim.rs", "-o", folder / "libshim.a"])
    sources = [folder / f"{peer}_model.c" for peer in PEERS if not peer.startswith("symforce")]
    sources += [folder / "symforce_model.cpp", folder / "romc" / "ours.c", folder / "driver.c"]
    objects = []
    for source in sources:
        objects.append(folder / f"{source.stem}.o")
        compiler = "g++" if source.suffix == ".cpp" else "gcc"
        call([compiler, *flags.split(), "-w", f"-I{folder / 'romc'}", "-c", source, "-o", objects[-1]])
    libraries = ["-lm", "-lpthread", "-ldl"]
    call(["gcc", *objects, folder / "libshim.a", *libraries, "-o", folder / "driver"])
    output = call([folder / "driver"], stdout=subprocess.PIPE, text=True).stdout
    times = {}
    for line in output.splitlines():
        name, ddz, jac = line.split()
        times[name] = (float(ddz), float(jac))
    return times


def table(title, names, rows):
    """A Markdown table with one column a model."""
    lines = [f"### {title}", "", "| | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
    lines += [f"| {name} | " + " | ".join(cells) + " |" for name, cells in rows]
    return "\n".join(lines) + "\n"


def ratios(times, key):
    """Best peer over romc: `ddz` alone and with Jacobian."""
    return [min(times[peer][k] for peer in PEERS) / times[key][k] for k in (0, 1)]


def report(results):
    """The tables of all models, as Markdown."""
    names = list(results)
    pair = lambda values: " / ".join(f"{value:.1f}" for value in values)
    parts = []
    for flags in FLAGS:
        times = {name: results[name]["time"][flags] for name in names}
        rows = [(row, [pair(times[name][row]) for name in names]) for row in [*PEERS, "romc", "romc_rust"]]
        for row in ("romc_batch", "romc_rust_batch"):
            rows.append((f"{row} (`ddz`, per point)", [f"{times[name][row][0]:.1f}" for name in names]))
        for key in ("romc", "romc_rust"):
            rows.append((f"**best peer : {key}**", [f"**{pair(ratios(times[name], key))}**" for name in names]))
        rows.append(("single point : batch, C", [f"{times[n]['romc'][0] / times[n]['romc_batch'][0]:.1f}" for n in names]))
        parts.append(table(f"Nanoseconds of `ddz` / `ddz` with Jacobian, gcc {flags}", names, rows))
    cost = lambda row: [" / ".join(f"{v:.0f}" for v in results[name]["cost"][row]) for name in names]
    title = "From coefficients to code: CPU ms / peak MB of the whole process"
    parts.append(table(title, names, [(row, cost(row)) for row in [*PEERS, "romc"]]))
    return "\n".join(parts)


def machine():
    """The machine of the measurements."""
    processor = next(line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name"))
    versions = [call(command, stdout=subprocess.PIPE, text=True).stdout.splitlines()[0] for command in (["gcc", "--version"], ["rustc", "--version"])]
    packages = sorted({package for packages in REQUIREMENTS.values() for package in packages})
    return "; ".join([processor.split(":")[1].strip(), *versions, *packages])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--models", help="folder with models of the standard library (d, poly_order, xi)")
    parser.add_argument("--only", help="names of models, separated by commas")
    parser.add_argument("--work", default=ROOT / "target" / "codegen-bench", type=Path)
    parser.add_argument("--romc", default=ROOT / "target" / "release" / "romc", type=Path)
    parser.add_argument("--output", type=Path, help="page whose part between the marks becomes the tables")
    arguments = parser.parse_args()
    chosen = models.read(arguments.models)
    if arguments.only:
        chosen = {name: chosen[name] for name in arguments.only.split(",")}
    results = {}
    for name, model in chosen.items():
        started = time.monotonic()
        folder, cost = emit(arguments.work.resolve(), arguments.romc.resolve(), name, model)
        timed = {flags: time_code(folder, model, flags) for flags in FLAGS}
        results[name] = {"cost": cost, "time": timed}
        print(f"{name}: {time.monotonic() - started:.0f} s", file=sys.stderr)
    tables = f"Measured on {machine()}.\n\n{report(results)}"
    print(tables)
    if arguments.output:
        replace_tables(arguments.output, tables)


def replace_tables(page, tables):
    """Puts the tables between the marks of a page."""
    begin, end = "<!-- tables of run.py -->\n", "<!-- end of tables -->\n"
    before, rest = page.read_text().split(begin)
    after = rest.split(end)[1]
    page.write_text(before + begin + tables + end + after)


if __name__ == "__main__":
    main()
