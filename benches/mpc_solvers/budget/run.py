#!/usr/bin/env python3
"""Worst-case instructions and memory of the controllers in C of the shipped models of the Go1, as Markdown tables.

    benches/mpc_solvers/budget/run.py ROMC

Each controller follows the jump of its self-test, pushed as there, with N = 20 stages. The first step, which linearises all
stages, and every twentieth run into the cap of 40 iterations as well, with the fallback after it: their solver has no tolerance and
moves by a tenth (`budget.c`). Instructions of every step are counted, by callgrind on x86-64 and by the clock of an emulator that
runs one instruction per nanosecond elsewhere; each number is a maximum over steps. Thousands of instructions: a step without
iterations, the same after `prepare`, an iteration, a step at the cap, the same after `prepare`; kilobytes. Needs gcc, valgrind, gcc-aarch64-linux-gnu, gcc-arm-none-eabi and qemu-system-arm.
"""

import concurrent.futures
import itertools
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
BOARD = ROOT / "tests/controller_c/cortex_m7"
CAP = 40
PROCESSORS = ["x86-64", "aarch64", "Cortex-M7"]
M7 = ["arm-none-eabi-gcc", "-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard", "-mthumb"]


def run(command, folder):
    return subprocess.run(list(map(str, command)), cwd=folder, check=True, capture_output=True, text=True).stdout


def counts_by_callgrind(program, folder):
    """Instructions of each call of `counted`, and the program's output."""
    dump = folder / f"{program.name}.callgrind"
    text = run(["valgrind", "-q", "--tool=callgrind", f"--callgrind-out-file={dump}", "--toggle-collect=counted",
                "--dump-after=counted", program], folder)
    dumps = sorted(folder.glob(f"{dump.name}.*"), key=lambda path: int(path.suffix[1:]))
    return [int(re.search(r"^(?:summary|totals): (\d+)", path.read_text(), re.M)[1]) for path in dumps], text


def measured(folder, name, real, processor, level):
    """Maxima of a compiled controller: instructions by kind of step, bytes of state, stack and code."""
    program = folder / f"budget-{processor}{level}"
    flags = ["-std=gnu99", level, "-ffp-contract=off", f"-DREAL={real}", f"-DNAME={name}", f'-DHEADER="{name}_controller.h"',
             f'-DJUMP="{name}_jump.h"', "-I."]
    sources = ["endless.c", f"{name}.c", HERE / "budget.c"]
    taken = None
    if processor == "x86-64":
        run(["gcc", *flags, *sources, "-lm", "-o", program], folder)
        taken, text = counts_by_callgrind(program, folder)
    elif processor == "aarch64":
        run(["aarch64-linux-gnu-gcc", *flags, "-DBARE", "-static", "-nostdlib", f"-T{HERE / 'aarch64.ld'}",
             HERE / "aarch64.c", *sources, "-lm", "-lgcc", "-o", program], folder)
        text = run(["qemu-system-aarch64", "-M", "virt", "-cpu", "cortex-a72", "-icount", "shift=0", "-nodefaults", "-display", "none",
                    "-chardev", "stdio,id=out", "-semihosting-config", "enable=on,chardev=out", "-kernel", program], folder)
    else:
        run([*M7, *flags, "-nostartfiles", "--specs=rdimon.specs", f"-T{BOARD / 'link.ld'}", BOARD / "startup.c", *sources,
             "-lm", "-o", program], folder)
        text = run(["qemu-system-arm", "-M", "mps2-an500", "-icount", "shift=0", "-nographic", "-semihosting", "-kernel",
                    program], folder)
    lines = [list(map(int, line.split())) for line in text.splitlines()]
    (state, count), steps = lines[0], lines[1:]
    taken = taken or [step[4] for step in steps]
    assert len(taken) == len(steps) == 3 * count, (len(taken), len(steps))
    found = {"state": state, "code": 0}
    for k, ((prepared, lift, status, iterations, _, stack), spent) in enumerate(zip(steps, taken)):
        kind = "cap" if iterations == CAP else "calm" if iterations == 0 and 0 <= status < 10 else "other"
        if lift and kind == "calm" and steps[k - 2 * count][3] == 0:
            kind, spent = "lift", spent - taken[k - 2 * count]
        for key, value in ((kind + "P" * prepared, spent), ("lifted stack" if lift else "stack", stack)):
            found[key] = max(found.get(key, 0), value)
    if processor == "Cortex-M7":
        for source in [f"{name}_controller.c", f"{name}.c"]:
            run([*M7, *flags, "-c", source, "-o", "object.o"], folder)
            found["code"] += sum(map(int, run(["arm-none-eabi-size", "object.o"], folder).splitlines()[1].split()[:2]))
    return found


def emitted(romc, work, dimension, precision):
    """Folder and name of a generated controller whose tolerance can be disabled."""
    name, folder = f"go1_d{dimension}", work / precision
    run([romc, "compile", ROOT / f"models/go1-d{dimension}.json", "--emit", "controller-c", "--precision", precision,
         "--out-dir", folder], ROOT)
    folder = folder / f"{name}-controller-c"
    text = (folder / f"{name}_controller.c").read_text()
    for old, new in [("is_linked ? LINK_TOLERANCE : TOLERANCE", "is_endless ? -1 : TOLERANCE"),
                     ("    solver_program_move_by(self, longest,", "    solver_program_move_by(self, is_endless ? longest / 10 : longest,")]:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "endless.c").write_text("extern int is_endless;\n" + text)
    return folder, name


def main():
    romc = pathlib.Path(sys.argv[1]).resolve()
    models = sorted(int(path.stem[5:]) for path in (ROOT / "models").glob("go1-d*.json"))
    kilo = "{:.0f}".format
    with tempfile.TemporaryDirectory() as work, concurrent.futures.ThreadPoolExecutor() as pool:
        cases = {}
        for dimension, precision in itertools.product(models, ["f64", "f32"]):
            folder, name = emitted(romc, pathlib.Path(work), dimension, precision)
            real = {"f64": "double", "f32": "float"}[precision]
            for level, processor in itertools.product(["-O2", "-O3"], PROCESSORS):
                case = (dimension, precision, level, processor)
                cases[case] = pool.submit(measured, folder, name, real, processor, level)
        found = {case: future.result() for case, future in cases.items()}
    print("| d | | " + " | ".join(PROCESSORS) + " |\n|---|---|" + "---|" * len(PROCESSORS))
    for dimension, precision, level in itertools.product(models, ["f64", "f32"], ["-O2", "-O3"]):
        cells = []
        for processor in PROCESSORS:
            of = found[dimension, precision, level, processor]
            iteration = (of["capP"] - of["calmP"]) / CAP
            numbers = [of["calm"], of["calmP"], iteration, of["cap"], of["capP"]]
            cells.append(" / ".join(kilo(number / 1000) for number in numbers))
        print(f"| {dimension} | {precision} {level} | " + " | ".join(cells) + " |")
    print("\n| d | | state | stack | with the consistent lift | code -O2 | -O3 | consistent lift, instructions |\n|" + "---|" * 8)
    for dimension, precision in itertools.product(models, ["f64", "f32"]):
        of, fast = (found[dimension, precision, level, "Cortex-M7"] for level in ["-O2", "-O3"])
        sizes = [of["state"], of["stack"], of["lifted stack"], of["code"], fast["code"]]
        print(f"| {dimension} | {precision} | " + " | ".join(f"{size / 1000:.1f}" for size in sizes) + f" | {of['lift'] / 1000:.0f} |")


if __name__ == "__main__":
    main()
