#!/usr/bin/env python3
"""Numbers and pictures of README.md and docs/, with the commands that make them.

    .ci/numbers.py check              the stored outputs are there, belong to the inputs of today, and the pages agree
    .ci/numbers.py update [NAME ...]  runs commands again and stores their outputs (all that are neither kept nor slow, without names)
    .ci/numbers.py keep NAME ...      stores the tables of the pages, for entries that say why they are not run here
    .ci/numbers.py list

docs/numbers/commands.toml has an entry per NAME: `command` (run by bash in the root of the repository), `inputs` (files and
patterns whose digests are stored with the output), `files` for pictures that the command makes, `kept` with the reason why
the output is not made anew here, `slow` with the time of a command that runs only by its name (PYTHON is then an interpreter
with the packages of examples/mujoco), and `known` for constants that a table shows next to the output. docs/numbers/NAME.txt is the stored output. A page refers to it by a line
`<!-- numbers: NAME -->`: every number of the table or block below must be in the output, as printed or after a change of
unit by a power of ten, rounded.
"""
import argparse
import datetime
import hashlib
import os
import pathlib
import platform
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
STORE = ROOT / "docs" / "numbers"
MARK = re.compile(r"<!-- numbers: ([a-z0-9-]+) -->")
NUMBER = re.compile(r"(?<![\w.])[-+\u2212]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w]|\.\d)", re.I)
SCALES = [10.0**power for power in (0, 3, -3, 2, -2, 6, -6)]
MOST_UNCHECKED = 12  # whole numbers up to here are counts, numbers of rows, phases or dimensions


def entries():
    with open(STORE / "commands.toml", "rb") as file:
        return tomllib.load(file)


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def digests(entry):
    found = {}
    for pattern in entry.get("inputs", []) + entry.get("files", []):
        paths = sorted(path for path in ROOT.glob(pattern) if path.is_file())
        if not paths:
            raise SystemExit(f"docs/numbers/commands.toml: `{pattern}` matches no file")
        for path in paths:
            found[str(path.relative_to(ROOT))] = digest(path)
    return found


def machine():
    names = re.findall(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text()) if os.path.exists("/proc/cpuinfo") else []
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


def write(name, entry, output, how):
    head = [f"{how} on {datetime.date.today()}, {machine()}", "$ " + entry["command"].strip().replace("\n", "\n$ ")]
    head += [f"{value}  {path}" for path, value in digests(entry).items()]
    (STORE / f"{name}.txt").write_text("\n".join(head) + "\n---\n" + output.rstrip() + "\n", encoding="utf-8")


def read(name):
    path = STORE / f"{name}.txt"
    if not path.is_file():
        return None
    head, output = path.read_text(encoding="utf-8").split("\n---\n", 1)
    lines = [line.split("  ", 1) for line in head.split("\n") if re.match(r"[0-9a-f]{16}  ", line)]
    command = "\n".join(line[2:] for line in head.split("\n") if line.startswith("$ "))
    return {path: value for value, path in lines}, command, output


def pages():
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks():
    """Yields page, line, name and text of every marked block: up to the first empty line after its first line of text."""
    for page in pages():
        lines = page.read_text(encoding="utf-8").split("\n")
        for number, line in enumerate(lines):
            for name in MARK.findall(line):
                text, is_code = [], False
                for following in lines[number + 1 :]:
                    if following.startswith("```"):
                        if is_code:
                            break
                        is_code = True
                        continue
                    if not is_code and not following.strip() and text:
                        break
                    if following.strip():
                        text.append(following)
                yield page.relative_to(ROOT), number + 1, name, "\n".join(text)


def numbers(text):
    text = text.replace("\u2212", "-")
    for found in NUMBER.finditer(text):
        yield found.group(0), float(found.group(0))


def missing(block, output, constants):
    """Numbers of a page's block that no number of the output rounds to."""
    known = [value for _, value in numbers(output)] + constants
    absent = []
    for shown, value in numbers(block):
        if value == int(value) and abs(value) <= MOST_UNCHECKED:
            continue
        decimals = len(shown.partition("e")[0].partition(".")[2])
        exponent = int(shown.lower().partition("e")[2] or 0)
        half = 0.5000001 * 10.0 ** (exponent - decimals)
        if not any(abs(abs(scale * other) - abs(value)) <= half for other in known for scale in SCALES):
            absent.append(shown)
    return absent


def check():
    faults, all_entries, named = [], entries(), set()
    for name, entry in all_entries.items():
        stored = read(name)
        if stored is None:
            faults.append(f"docs/numbers/{name}.txt is missing: run .ci/numbers.py update {name}")
            continue
        now = digests(entry)
        changed = sorted(path for path in now.keys() | stored[0].keys() if now.get(path) != stored[0].get(path))
        if changed:
            faults.append(f"{name}: changed since its numbers were made: {', '.join(changed)}")
        if stored[1] != entry["command"].strip():
            faults.append(f"{name}: its command changed since its numbers were made")
    for page, line, name, block in blocks():
        named.add(name)
        stored = read(name) if name in all_entries else None
        if name not in all_entries:
            faults.append(f"{page}:{line}: `{name}` is not in docs/numbers/commands.toml")
        elif stored:
            absent = missing(block, stored[2], all_entries[name].get("known", []))
            if absent:
                faults.append(f"{page}:{line}: not in docs/numbers/{name}.txt: {', '.join(absent)}")
    pictures = {path for entry in all_entries.values() for path in entry.get("files", [])}
    for page in pages():
        for target in re.findall(r"!\[[^\]]*\]\(([^)\s]+)\)|<img[^>]*src=\"([^\"]+)\"|srcset=\"([^\"]+)\"", page.read_text(encoding="utf-8")):
            target = next(part for part in target if part)
            if target.startswith("http"):
                continue
            path = (page.parent / target).resolve()
            if not path.is_file():
                faults.append(f"{page.relative_to(ROOT)}: no picture {target}")
            elif str(path.relative_to(ROOT)) not in pictures:
                faults.append(f"{page.relative_to(ROOT)}: no command makes {target}")
    for name, entry in all_entries.items():
        if name not in named and not entry.get("files"):
            faults.append(f"docs/numbers/commands.toml: no page shows `{name}`")
    return faults


def update(names):
    (ROOT / "target" / "numbers").mkdir(parents=True, exist_ok=True)  # of models that commands make
    for name, entry in entries().items():
        if (names and name not in names) or (not names and (entry.get("kept") or entry.get("slow"))):
            continue
        print(f"{name} ...", flush=True)
        # Scripts that run for minutes print their progress to stderr.
        notes = subprocess.PIPE if entry.get("slow") else subprocess.STDOUT
        run = subprocess.run(["bash", "-e", "-o", "pipefail", "-c", entry["command"]], cwd=ROOT, stdout=subprocess.PIPE, stderr=notes, text=True)
        if run.returncode:
            raise SystemExit(f"{name}: {run.stdout}{run.stderr or ''}")
        write(name, entry, run.stdout, "run")


def keep(names):
    for name in names:
        entry = entries()[name]
        if not entry.get("kept"):
            raise SystemExit(f"{name} has no `kept` in docs/numbers/commands.toml")
        output = "\n\n".join(block for _, _, other, block in blocks() if other == name)
        write(name, entry, output, f"kept ({entry['kept']}), stored")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=["check", "update", "keep", "list"])
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in entries()]
    if unknown:
        raise SystemExit(f"not in docs/numbers/commands.toml: {', '.join(unknown)}")
    if arguments.action == "list":
        for name, entry in entries().items():
            print(f"{name}: {entry['command']}" + "".join(f"  ({how}: {entry[how]})" for how in ("kept", "slow") if how in entry))
    elif arguments.action == "update":
        update(arguments.names)
    elif arguments.action == "keep":
        keep(arguments.names)
    elif faults := check():
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
