#!/usr/bin/env python3
"""The documentation site: generated pages, links, and the commands that pages show.

    .ci/docs.py generate [--romc target/release/romc]    writes docs/reference/commands.md and docs/reference/json.md
    .ci/docs.py check [--romc target/release/romc]       these are up to date, every link leads somewhere, docs/SUMMARY.md has
                                                         every page, every message of docs/reference/messages.md is in
                                                         the sources, tables of README.md fit 80 columns
    .ci/docs.py run [--romc ...] [--python ... [--slow]] [PAGE ...]
                                                         runs the `sh` blocks of README.md and of the pages, and compares
                                                         their output with the `text` blocks below them; pages of
                                                         docs/evaluation have their commands in docs/numbers; each
                                                         page runs in a copy of the repository's examples and models
"""
import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
GO1 = "examples/recordings/go1"
# Commands whose JSON is described; small inputs, so that the page is made in seconds.
JSON_COMMANDS = [
    "inspect models/go1-d4.json",
    f"inspect {GO1}/test_01.csv.gz",
    f"simulate models/go1-d4.json {GO1}/test_01.csv.gz --verbose",
    f"mpc models/go1-d4.json {GO1}/test_01.csv.gz",
    "plan models/go1-d7.json --distance 0.35 --apex 0.12 --output {out}/plan.csv",
    "plan models/go1-trot-d6.json --speed 0.5 --output {out}/walk.csv",
    "compile models/go1-d4.json --emit latex --out-dir {out}/code",
    f"report models/go1-d4.json {GO1}/test_01.csv.gz --output {{out}}/report.html",
    f"identify {GO1}/test_01.csv.gz {GO1}/test_02.csv.gz --robot go1",
    "check models/paper-2d.json models/paper-2d.json",
    f"train {GO1}/train_01.csv.gz {GO1}/train_02.csv.gz --latent-dim 2 --output {{out}}/model.json",
    "robot go1 --output {out}/go1.toml",
    f"convert {GO1}/test_01.csv.gz --output {{out}}/copy.csv",
]


def output_of(romc, *arguments):
    run = subprocess.run([romc, *arguments], cwd=ROOT, capture_output=True, text=True)
    if run.returncode not in (0, 1):
        raise SystemExit(f"romc {' '.join(arguments)}: {run.stderr}")
    return run.stdout


def commands_page(romc):
    top = output_of(romc, "--help")
    names = [name for name in re.findall(r"^  ([a-z][a-z-]*)  +\S", top[top.index("Commands:") :], re.M) if name != "help"]
    parts = ["# Commands", "", "This page contains the help of every command. `.ci/docs.py generate` makes it from the program.", ""]
    parts += ["```text", top.rstrip(), "```", ""]
    for name in names:
        parts += [f"## romc {name}", "", "```text", output_of(romc, name, "--help").rstrip(), "```", ""]
    return "\n".join(parts)


def keys(value, path=""):
    """Yields the path and the type of every value; entries of a list, and objects with the same keys, share their lines."""
    if isinstance(value, dict) and have_same_keys(value):
        yield f"{path}.*", f"objects, here `{'`, `'.join(value)}`"
        yield from keys(next(iter(value.values())), f"{path}.*")
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from keys(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        if value:
            yield from keys(value[0], f"{path}[]")
        else:
            yield path, "list, empty here"
    else:
        kind = {str: "text", bool: "true or false", int: "number", float: "number", type(None): "null here"}[type(value)]
        yield path, kind


def have_same_keys(value):
    """Whether the values are several objects with the same keys, such as those of phases and coordinates."""
    if len(value) < 2 or not all(isinstance(inner, dict) and inner for inner in value.values()):
        return False
    first, *others = ([path for path, _ in keys(inner)] for inner in value.values())
    return all(other == first for other in others)


def json_page(romc):
    parts = ["# JSON output", "", "With `--json`, every command prints one JSON object. This page lists its keys, one example per command.", ""]
    parts += ["`.ci/docs.py generate` makes this page from the program. Keys are stable within a minor version."]
    parts += ["`[]` stands for each entry of a list, and `*` for each of several objects with the same keys. [Metrics](metrics.md) defines the numbers.", ""]
    with tempfile.TemporaryDirectory() as out:
        for command in JSON_COMMANDS:
            value = json.loads(output_of(romc, *command.format(out=out).split(), "--json"))
            parts += [f"## romc {command.split()[0]}", ""] if f"## romc {command.split()[0]}" not in parts else []
            parts += ["```text", "romc " + command.format(out="out") + " --json", "```", "", "| key | value |", "|---|---|"]
            parts += [f"| `{path}` | {kind} |" for path, kind in dict(keys(value)).items()]
            parts += [""]
    return "\n".join(parts)


GENERATED = {"reference/commands.md": commands_page, "reference/json.md": json_page}


def anchors(text):
    found = set()
    for line in re.sub(r"^```.*?^```", "", text, flags=re.S | re.M).split("\n"):
        title = re.match(r"#+ (.*)", line)
        if title:
            bare = re.sub(r"[`*]|\[|\]\([^)]*\)", "", title.group(1)).lower()
            found.add(re.sub(r"[^\w\- ]", "", bare).strip().replace(" ", "-"))
    return found | set(re.findall(r'(?:id|name)="([^"]+)"', text))


def links(page):
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    text = re.sub(r"`[^`\n]*`", "", text)
    yield from re.findall(r"\]\(([^)\s]+)\)", text)
    yield from re.findall(r'(?:href|src)="([^"]+)"', text)


def pages():
    return sorted(path for path in DOCS.rglob("*.md"))


def texts_of_program():
    """Everything that the program can print, on one line: sources, with placeholders as gaps."""
    sources = [path.read_text(encoding="utf-8") for folder in ("src", "python/src") for path in sorted((ROOT / folder).rglob("*.rs"))]
    text = re.sub(r"\\\n\s*", "", "\n".join(sources))
    text = re.sub(r"\{[\w.:?#<>$*]*\}", "\0", text)
    return " ".join(text.split()).replace('\\"', '"').replace("`", "")


# Put together from words, or printed by the library that reads the command line.
COMPOSED = {"joint rates clip at", "invalid value"}


def messages():
    """Faults of the page of messages: texts that the program does not print. Parts count between `...`, numbers, options
    and the words that a message is put together from; of the words of a part six of ten have to stand in one place."""
    known, page = texts_of_program(), "docs/reference/messages.md"
    for line, row in enumerate((ROOT / page).read_text(encoding="utf-8").split("\n"), 1):
        for text in re.findall(r"`([^`]+)`", row.split(" | ")[0]) if row.startswith("| `") else []:
            text = re.sub(r"^(note|error|warning|FAILED|because):? ", "", text)
            for part in re.split(r"\.\.\.|\bexpected\b|\bfound\b|: |--[a-z-]+|[();,?]|\b[A-Z]{3,}\b|\b\d[\d.]*\b", text):
                words = part.split()
                size = -(-len(words) * 6 // 10)
                runs = [" ".join(words[at : at + size]) for at in range(len(words) - size + 1)]
                if len(part) >= 9 and " ".join(words) not in COMPOSED and not any(run in known for run in runs):
                    yield f"{page}:{line}: the program does not print `{part.strip()}`"


def check(romc):
    faults = list(messages())
    for name, make in GENERATED.items():
        if not (DOCS / name).is_file() or (DOCS / name).read_text(encoding="utf-8") != make(romc):
            faults.append(f"docs/{name} is not what the program prints: run .ci/docs.py generate")
    outside = [ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "python/README.md")]
    for page in outside + pages():
        here = page.relative_to(ROOT)
        for link in links(page):
            if re.match(r"[a-z]+:", link):
                continue
            file, _, anchor = link.partition("#")
            target = (page.parent / file).resolve() if file else page
            if not target.exists():
                faults.append(f"{here}: no file {link}")
            elif anchor and target.suffix == ".md" and anchor not in anchors(target.read_text(encoding="utf-8")):
                faults.append(f"{here}: no heading for {link}")
            elif page.is_relative_to(DOCS) and not target.is_relative_to(DOCS):
                faults.append(f"{here}: {link} leaves docs/, so that the site cannot show it")
    summary = set(links(DOCS / "SUMMARY.md"))
    for page in pages():
        if page.name != "SUMMARY.md" and str(page.relative_to(DOCS)) not in summary:
            faults.append(f"docs/SUMMARY.md does not have {page.relative_to(DOCS)}")
    readme = (ROOT / "README.md").read_text(encoding="utf-8").split("\n")
    faults += [f"README.md:{n}: a table of {len(line)} columns" for n, line in enumerate(readme, 1) if line.startswith("|") and len(line) > 80]
    if len(readme) > 141:
        faults.append(f"README.md has {len(readme) - 1} lines, at most 140")
    return faults


def blocks(page, kinds):
    """The `sh` blocks of a page: the line where each begins, its text, and the output that a `text` block right below
    shows. A comment `<!-- sh` above a block has commands that prepare for it. Blocks `sh,fails` have to fail, `sh,python`
    and `sh,slow` run if they are among the kinds, the slow ones in a shell of their own, whose folder is not that of later
    blocks, and `sh,ignore` do not run here."""
    text = page.read_text(encoding="utf-8")
    above = r"(?:^<!-- sh\n(.*?)^-->\n)?"
    below = r"(?:(?:[^\s`]+\s+){0,9}?```text\n(.*?)^```)?"  # a few words may stand between
    for found in re.finditer(above + r"^```sh((?:,\w+)*)\n(.*?)^```\s*" + below, text, flags=re.S | re.M):
        prepares, words, script, shown = found.groups()
        asked = set(words.split(",")) - {"", "fails"}
        runs = asked <= kinds and ("slow" in asked or "cargo " not in script)  # the checks run README's commands themselves
        if runs:
            line = text[: found.start(3)].count("\n") + 1
            script = (prepares or "") + (refused(script) if "fails" in words else script)
            yield line, f"(set -e\n{script})\n" if "slow" in asked else script, shown


def refused(script):
    """A script that fails unless the given one does. Behind `!` and `if`, bash goes on after a command that fails."""
    unless = "echo 'succeeds, and the page shows a failure'; exit 1"
    return f"set +e\n(set -e\n{script})\nfailed=$?; set -e\n[ $failed -ne 0 ] || {{ {unless}; }}\n"


def session(page):
    """The Python blocks of a page as one program, with the output that `text` blocks right below them show; none without
    such output, or where the page's program is to be saved."""
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"^```python\n(.*?)^```\s*(?:```text\n(.*?)^```)?", text, flags=re.S | re.M)
    if programs(page) or not any(shown for _, shown in found):
        return []
    program = "".join(block for block, _ in found)
    line = text[: text.index("```python\n")].count("\n") + 2
    return [(line, f"python - <<'END_OF_PAGE'\n{program}END_OF_PAGE\n", "".join(shown for _, shown in found))]


def programs(page):
    """Names and texts of the Python programs of a page that are to be saved."""
    return re.findall(r"Save it as `(\w+\.py)`:\s*```python\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.S | re.M)


def comparable(line):
    """A line of output without the width of columns and without times, which differ between runs."""
    return re.sub(r"\b[\d.]+ (?=(?:s|ms|us)\b)", "# ", " ".join(line.split()))


def absent(shown, printed):
    """The first line of a page's block that the output does not have, in this order. `...` stands for any lines, or for
    the rest of one."""
    rest = [comparable(line) for line in printed.splitlines()]
    for line in map(comparable, shown.splitlines()):
        if line in ("", "..."):
            continue
        begins = line.removesuffix("...")
        is_it = str.startswith if line.endswith("...") else str.__eq__
        at = next((at for at, other in enumerate(rest) if is_it(other, begins)), None)
        if at is None:
            return line
        rest = rest[at + 1 :]
    return None


def run(arguments):
    python, slow = arguments.python, arguments.slow
    kinds = {kind for kind, is_on in (("python", python), ("slow", slow)) if is_on}
    usual = [page for page in pages() if page.parent.name != "evaluation"]
    usual = [page for page in [ROOT / "README.md", *usual] if not slow or "```sh,slow" in page.read_text(encoding="utf-8")]
    chosen = [ROOT / name for name in arguments.pages] or usual
    faults = []
    for page in chosen:
        script = sorted([*blocks(page, kinds), *(session(page) if python else [])])
        if not script:
            continue
        begun = time.monotonic()
        with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as outputs:
            folder, outputs = pathlib.Path(folder), pathlib.Path(outputs)
            for name in ("examples", "models", "docs", "python", "benches"):
                shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=shutil.ignore_patterns("target", "node_modules"))
            for place in (folder / "bin", folder / "target" / "release"):
                place.mkdir(parents=True)
                (place / "romc").symlink_to(pathlib.Path(arguments.romc).resolve())
            for name, is_module in (("python", ""), ("pip", "-m pip")) if python else ():
                (folder / "bin" / name).write_text(f'#!/bin/sh\nexec {pathlib.Path(python).absolute()} {is_module} "$@"\n')
                (folder / "bin" / name).chmod(0o755)
            for name, program in programs(page):
                (folder / name).write_text(program, encoding="utf-8")
            environment = dict(os.environ, PATH=f"{folder / 'bin'}:{os.environ['PATH']}", REPOSITORY=str(ROOT))
            text = "set -e\n" + "".join(f"exec >'{outputs / str(line)}' 2>&1\n{block}" for line, block, _ in script)
            done = subprocess.run(["bash", "-c", text], cwd=folder, env=environment)
            here = page.relative_to(ROOT)
            ran = [(line, shown, (outputs / str(line)).read_text(encoding="utf-8")) for line, _, shown in script if (outputs / str(line)).exists()]
            if done.returncode:  # of the last block that began
                line, _, printed = ran.pop()
                faults.append(f"{here}:{line}: {(printed.strip() or 'failed').splitlines()[-1]}")
            for line, shown, printed in ran:
                if shown and (lost := absent(shown, printed)) is not None:
                    faults.append(f"{here}:{line}: the page shows `{lost}`, which the commands do not print")
        print(f"{here}: {len(script)} blocks, {time.monotonic() - begun:.0f} s", flush=True)
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=["generate", "check", "run"])
    parser.add_argument("pages", nargs="*")
    parser.add_argument("--romc", default=str(ROOT / "target/release/romc"))
    parser.add_argument("--python", help="interpreter with romc and PyTorch for `sh,python` and Python blocks")
    parser.add_argument("--slow", action="store_true", help="the pages with `sh,slow` blocks, and these too; they need MuJoCo")
    arguments = parser.parse_intermixed_args()
    if arguments.action == "generate":
        for name, make in GENERATED.items():
            (DOCS / name).write_text(make(arguments.romc), encoding="utf-8")
        return
    faults = check(arguments.romc) if arguments.action == "check" else run(arguments)
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
