"""Floating-point operations that a program executed: additions, multiplications, divisions and square roots.

    python3 operations.py PROGRAM CALLGRIND_FILE

PROGRAM is compiled for x86-64 without vectors (`-fno-tree-vectorize -no-pie`), so that each of these instructions is one
operation; CALLGRIND_FILE is of `valgrind --tool=callgrind --dump-instr=yes --compress-pos=no`. Negations, comparisons,
conversions and what libm does inside are not counted.
"""

import re
import subprocess
import sys


def operations(program):
    """Addresses of the instructions that are operations."""
    listing = subprocess.run(["objdump", "-d", "--no-show-raw-insn", program], check=True, capture_output=True, text=True)
    found = re.finditer(r"^\s*([0-9a-f]+):\t(?:add|sub|mul|div|sqrt)s[ds]\s", listing.stdout, re.MULTILINE)
    return {int(match.group(1), 16) for match in found}


def counted(path, addresses):
    """How often these addresses were executed; the line after `calls=` is what the callee took."""
    total, is_call = 0, False
    with open(path) as lines:
        for line in lines:
            match = re.match(r"0x([0-9a-f]+) \S+ (\d+)", line)
            if match and not is_call and int(match.group(1), 16) in addresses:
                total += int(match.group(2))
            is_call = line.startswith("calls=")
    return total


if __name__ == "__main__":
    print(counted(sys.argv[2], operations(sys.argv[1])))
