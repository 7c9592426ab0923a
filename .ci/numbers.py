#!/usr/bin/env python3
"""Numbers and pictures of README.md and docs/, with the commands that make them.

    .ci/numbers.py check              the stored outputs are there, belong to the inputs of today, and the pages agree
    .ci/numbers.py mutate [SEED]      changes each number of the pages, one at a time, and counts changes that `check` accepts
    .ci/numbers.py update [NAME ...]  runs commands again and stores their outputs (all that are neither kept nor slow, without names)
    .ci/numbers.py keep NAME ...      stores the tables of the pages, for entries that say why they are not run here
    .ci/numbers.py list               the commands, and tables of results without a mark

docs/numbers/commands.toml has an entry per NAME: `command` (run by bash in the root of the repository), `inputs` (files and
patterns whose digests are stored with the output), `files` for pictures that the command makes, `kept` with the reason why
the output is not made anew here, `slow` with the time of a command that runs only by its name (PYTHON is then an interpreter
with the packages of examples/mujoco, FOLDER has the recordings of docs/evaluation/hardware.md), and `known` for constants
that a table shows next to the output. docs/numbers/NAME.txt is the stored output. Pages refer to it by a line above a table,
a block of code or a paragraph:

    <!-- numbers: NAME -->              Rows of the table are lines of the output, or columns of its tables, in the same order,
                                        each with all its numbers in their order. `NAME; 3 lines`: a row is in three lines.
    <!-- numbers: NAME; A, B; C;; D --> Rows are put together. For each of the last columns of the table: patterns that match
                                        the lines with its numbers, or the headings above these lines. Of the lines, those
                                        count that have the most words of the row's name. Nothing between `;` joins the
                                        column to the one before: their numbers are in one line or column, in their order.

Lines of code are lines of the output. A paragraph's numbers are in the output (in lines that match one of the patterns), its
`N of M` as a whole. All numbers may be rounded. They may have the unit of their cell, column, row or introduction (mm, mrad,
cm, %, ms, us) where the output has m, rad, 1 or s. Numbers in names of rows are in the same line if those of most rows are;
those in other names are anywhere in the output or its command. NAME may be several names.
"""
import argparse
import collections
import datetime
import functools
import hashlib
import itertools
import os
import pathlib
import platform
import random
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
STORE = ROOT / "docs" / "numbers"
MARK = re.compile(r"<!-- numbers: ([a-z0-9 -]+?)(?:; ?(.*?))? -->")
NUMBER = re.compile(r"(?<![\w.^])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w|\.\d)", re.I)
NUMBER_OR_DASH = re.compile(NUMBER.pattern + r"|(?<=\s)-(?=\s|$)", re.I)
SHARE = re.compile(r"(?<![\w.^])\d+ of \d+(?!\.?\d)")
UNIT = re.compile(r"(?<![\w/])(mm|mrad|cm|ms|us|%)(?![\w/])")
SCALES = {"mm": (1e3,), "mrad": (1e3,), "cm": (1e2,), "%": (1e2,), "ms": (1e3,), "us": (1e3, 1e6)}
PART = re.compile(r"(models|target)/|\S+ from \d+ recordings|[\w-]+$")  # lines that begin a part of an output

Number = collections.namedtuple("Number", "shown value bounds")
Block = collections.namedtuple("Block", "page line names options introduction is_code text")


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
    (STORE / f"{name}.txt").write_text("\n".join(head) + "\n---\n" + output.rstrip().replace(f"{ROOT}/", "") + "\n", encoding="utf-8")


@functools.cache
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
    """Yields every marked block: up to the first empty line after its first line of text."""
    for page in pages():
        lines = page.read_text(encoding="utf-8").split("\n")
        for number, line in enumerate(lines):
            if not (mark := MARK.search(line)):
                continue
            text, is_code, introduction = [], False, ""
            for before in itertools.takewhile(str.strip, reversed(lines[: number - 1])):
                introduction = before + " " + introduction
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
            options = [option.strip() for option in mark[2].split(";")] if mark[2] else []
            yield Block(page.relative_to(ROOT), number + 1, mark[1].split(), options, introduction, is_code, "\n".join(text))


def unmarked():
    for page in [ROOT / "README.md", *sorted((ROOT / "docs" / "evaluation").glob("*.md"))]:
        for above, table in re.findall(r"([^\n]*)\n((?:^\|[^\n]*\n)+)", page.read_text(encoding="utf-8"), re.M):
            if not MARK.search(above) and any("." in shown for shown in NUMBER.findall(table)):
                yield f"{page.relative_to(ROOT)}: {table.split(chr(10))[0]}"


def values(text):
    """The numbers of a line of an output; None for a dash in front of one."""
    found = [None if value == "-" else float(value) for value in NUMBER_OR_DASH.findall(text.replace("\u2212", "-"))]
    while found and found[-1] is None:
        found.pop()
    return found


def numbers(text, units=""):
    """The numbers of a page's text, with the bounds of the values that they may be rounded from, in any of the units."""
    scales = {1.0, *(scale for unit in UNIT.findall(units) for scale in SCALES[unit])}
    for shown in NUMBER.findall(text.replace("\u2212", "-")):
        decimals = len(shown.lower().partition("e")[0].partition(".")[2])
        exponent = int(shown.lower().partition("e")[2] or 0)
        value, half = float(shown), 0.5000001 * 10.0 ** (exponent - decimals)
        yield Number(shown, value, [((value - half) / scale, (value + half) / scale) for scale in scales])


def fits(number, value):
    return value is not None and any(low <= value <= high for low, high in number.bounds)


def found_in_order(row, place):
    """How many of the first numbers of a row are in a line or column of an output, in their order."""
    count = 0
    for value in place:
        if count < len(row) and fits(row[count], value):
            count += 1
    return count


def lines_and_columns(lines):
    """Lines of values, and the columns of neighbouring lines that have as many values."""
    places = []
    for _, group in itertools.groupby(lines, key=len):
        group = list(group)
        places += group + [list(column) for column in zip(*group) if len(group) > 1]
    return [place for place in places if place]


@functools.cache
def places_of(output):
    return lines_and_columns(map(values, output.split("\n")))


@functools.cache
def lines_of(output):
    """The lines of an output: number of the paragraph, text after part, title and head of the table, values."""
    lines, part, title = [], "", ""
    for index, paragraph in enumerate(re.split(r"\n[ \t]*\n", output)):
        texts = paragraph.split("\n")
        rule = next((number for number, text in enumerate(texts) if re.fullmatch(r"[\s|:-]*--[\s|:-]*", text)), 0)
        for text in texts:
            part = text if PART.match(text) else part
            lines.append((index, " ".join([part, title, *texts[: rule + 1], text]), values(text)))
        title = paragraph if len(texts) == 1 else ""
    return [line for line in lines if line[2]]


def matching(output, patterns):
    return [line for line in lines_of(output) if all(re.search(pattern, line[1]) for pattern in patterns.split(", "))]


def first_place(row, places, start, most):
    """The first of at most `most` places, from `start`, with the numbers of a row in their order."""
    for index in range(start, len(places)):
        count = found_in_order(row, places[index])
        if count == len(row) or most > 1 and count and first_place(row[count:], places, index + 1, most - 1) is not None:
            return index
    return None


def rows_not_found(rows, places, most):
    """Rows that are not lines or columns of the output, in the order of the output."""
    absent, start = [], 0
    for row in rows:
        index = first_place(row, places, start, most)
        if index is None:
            absent.append(row)
        else:
            start = index
    return absent


def cells_not_found(names, rows, output, patterns):
    """Cells that are not in a line or column of the lines of their patterns that have the most words of the row's name."""
    groups = []
    for column, pattern in enumerate(patterns, -len(patterns)):
        if pattern:
            groups.append((matching(output, pattern), []))
        groups[-1][1].append(column)
    for name, row in zip(names, rows):
        words = {word.strip(".") for word in re.findall(r"[\w^.+-]{3,}|\d+", name)}
        words = [re.compile(rf"(?<![\w^-])(?<!\d\.){re.escape(word)}(?![\w-]|\.\d)") for word in words]
        for lines, columns in groups:
            wanted = [number for column in columns for number in row[column]]
            scores = [sum(bool(word.search(line[1])) for word in words) for line in lines]
            best = [line for line, score in zip(lines, scores) if score == max(scores) and (score or re.search("[a-z]", name))]
            places = []
            for _, group in itertools.groupby(best, key=lambda line: line[0]):
                places += lines_and_columns(sorted((line[2] for line in group), key=len))
            if not any(found_in_order(order, place) == len(wanted) for place in [[], *places] for order in (wanted, wanted[::-1])):
                yield f"no line of the row `{name}` with {shown(wanted)}"


def shown(row):
    return ", ".join(number.shown for number in row)


def cells(line):
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def table_faults(block, output, every, constants):
    head, *lines = [line for line in block.text.split("\n") if line.startswith("|")]
    head, lines = cells(head), [cells(line) for line in lines[1:]]
    is_by_column = len(block.options) > 0 and not re.fullmatch(r"\d+ lines", block.options[0])
    labels = len(head) - len(block.options) if is_by_column else 1
    names, rows, in_names = [], [], []
    for line in lines:
        names.append(" ".join(line[:labels]))
        row = []
        for cell, column in zip(line, head):
            unit = next((text for text in (cell, column, names[-1] + " " + block.introduction) if UNIT.search(text)), "")
            found = list(numbers(cell, unit))
            row.append([] if all(number.value in constants for number in found) else found)
        rows.append(row)
        in_names.append(row[0] if re.search("[a-z]", line[0], re.I) else [])
    if is_by_column:
        yield from cells_not_found(names, rows, output, block.options)
    else:
        most = int(block.options[0].split()[0]) if block.options else 1
        rows = [[number for cell in row for number in cell] for row in rows]
        # Where most numbers in names are on the lines of their rows, all must be.
        named = [row for row, name in zip(rows, in_names) if name]
        absent = rows_not_found(rows, places_of(output), most)
        if sum(row in absent for row in named) > len(named) / 2:
            absent = rows_not_found([row[len(name) :] for row, name in zip(rows, in_names)], places_of(output), most)
        else:
            in_names = []
        yield from (f"no line or column, after those of the rows above, with {shown(row)}" for row in absent)
    for number in itertools.chain(numbers(" ".join(head)), *in_names):
        if number.value not in every:
            yield f"{number.shown} in the name of a row or column is nowhere"


def faults_of(block, all_entries):
    """What a block shows and its outputs do not."""
    stored = [read(name) for name in block.names]
    output = "\n\n".join(part[2] for part in stored)
    constants = {value for name in block.names for value in all_entries[name].get("known", [])}
    if block.is_code:
        known = {" ".join(line.split()) for line in [*output.split("\n"), "..."]}
        return [f"no line {line}" for line in block.text.split("\n") if " ".join(line.split()) not in known]
    if block.text.startswith("|"):
        every = constants.union(values(output), *(values(part[1]) for part in stored))
        return list(table_faults(block, output, every, constants))
    every = {value for patterns in block.options or [""] for line in matching(output, patterns) for value in line[2]}
    shares = [share for share in SHARE.findall(block.text) if share not in SHARE.findall(output)]
    absent = [number.shown for number in numbers(block.text, block.text) if not any(fits(number, value) for value in every)]
    return [f"no {text}" for text in shares + absent]


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
    for block in blocks():
        named.update(block.names)
        for name in block.names:
            if name not in all_entries:
                faults.append(f"{block.page}:{block.line}: `{name}` is not in docs/numbers/commands.toml")
        if all(name in all_entries and read(name) for name in block.names):
            faults += [f"{block.page}:{block.line}: {' '.join(block.names)}: {fault}" for fault in faults_of(block, all_entries)]
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


def mutate(seed):
    """Changes each number of the blocks by a random factor at its printed digits, one at a time."""
    chance, accepted, all_entries = random.Random(seed), collections.defaultdict(list), entries()
    for block in blocks():
        if faults_of(block, all_entries):
            print(f"{block.page}:{block.line} is left out, because it fails")
            continue
        for found in NUMBER.finditer(block.text):
            number = next(numbers(found.group(0)))
            decimals = len(number.shown.lower().partition("e")[0].partition(".")[2])
            style = f".{decimals}e" if "e" in number.shown.lower() else f".{decimals}f"
            changed = format(number.value * chance.uniform(0.5, 2.5), style)
            if float(changed) != number.value:
                text = block.text[: found.start()] + changed + block.text[found.end() :]
                accepted[str(block.page)].append(not faults_of(block._replace(text=text), all_entries))
    for page, results in [*accepted.items(), ("all pages", [result for results in accepted.values() for result in results])]:
        print(f"{page}: {sum(results)} of {len(results)} changes accepted, {100 * sum(results) / len(results):.0f} %")


def update(names):
    (ROOT / "target" / "numbers").mkdir(parents=True, exist_ok=True)  # of models that commands make
    outputs = {}  # entries with equal commands share one run
    for name, entry in entries().items():
        if (names and name not in names) or (not names and (entry.get("kept") or entry.get("slow"))):
            continue
        print(f"{name} ...", flush=True)
        command = entry["command"]
        if command not in outputs:
            # Scripts that run for minutes print their progress to stderr.
            notes = subprocess.PIPE if entry.get("slow") else subprocess.STDOUT
            run = subprocess.run(["bash", "-e", "-o", "pipefail", "-c", command], cwd=ROOT, stdout=subprocess.PIPE, stderr=notes, text=True)
            if run.returncode:
                raise SystemExit(f"{name}: {run.stdout}{run.stderr or ''}")
            outputs[command] = run.stdout
        write(name, entry, outputs[command], "run")


def keep(names):
    for name in names:
        entry = entries()[name]
        if not entry.get("kept"):
            raise SystemExit(f"{name} has no `kept` in docs/numbers/commands.toml")
        output = "\n\n".join(block.text for block in blocks() if name in block.names)
        write(name, entry, output, f"kept ({entry['kept']}), stored")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=["check", "mutate", "update", "keep", "list"])
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    if arguments.action == "mutate":
        seed = arguments.names[0] if arguments.names else "1"
        if not seed.isdecimal():
            parser.error(f"seed of mutate: found {seed}, expected a whole number")
        mutate(int(seed))
        return
    unknown = [name for name in arguments.names if name not in entries()]
    if unknown:
        raise SystemExit(f"not in docs/numbers/commands.toml: {', '.join(unknown)}")
    if arguments.action == "list":
        for name, entry in entries().items():
            print(f"{name}: {entry['command']}" + "".join(f"  ({how}: {entry[how]})" for how in ("kept", "slow") if how in entry))
        print("\ntables with decimals and without a mark:", *unmarked(), sep="\n")
    elif arguments.action == "update":
        update(arguments.names)
    elif arguments.action == "keep":
        keep(arguments.names)
    elif faults := check():
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
