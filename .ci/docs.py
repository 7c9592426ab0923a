#!/usr/bin/env python3
"""The documentation site: generated pages, links, and the commands that pages show.

    .ci/docs.py generate [--romc target/release/romc]    writes docs/reference/commands.md and docs/reference/json.md
    .ci/docs.py check [--romc target/release/romc]       these are up to date, every link leads somewhere, docs/SUMMARY.md has
                                                         every page, tables of README.md fit 80 columns
    .ci/docs.py run [--romc ...] [PAGE ...]              runs the `sh` blocks of README.md and of the pages, but for those of
                                                         docs/evaluation, whose commands are in docs/numbers; each
                                                         page in a copy of the repository's examples and models
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
    f"simulate models/go1-d4.json {GO1}/test_01.csv.gz",
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
    """Yields the path and the type of every value; entries of a list and of a map of names share one line each."""
    if isinstance(value, dict):
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


def json_page(romc):
    parts = ["# JSON output", "", "With `--json`, every command prints one JSON object. This page lists its keys, one example per command.", ""]
    parts += ["`.ci/docs.py generate` makes this page from the program. Keys are stable within a minor version."]
    parts += ["`[]` stands for each entry of a list. [Metrics](metrics.md) defines the numbers.", ""]
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


def check(romc):
    faults = []
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


def blocks(page):
    """The `sh` blocks of a page, with the line where each begins."""
    text = page.read_text(encoding="utf-8")
    for found in re.finditer(r"^```sh\n(.*?)^```", text, flags=re.S | re.M):
        if "cargo " not in found.group(1):  # the checks run the demo and the tests themselves
            yield text[: found.start()].count("\n") + 2, found.group(1)


def run(romc, names):
    usual = [page for page in pages() if page.parent.name != "evaluation"]
    chosen = [ROOT / name for name in names] or [ROOT / "README.md", *usual]
    faults = []
    for page in chosen:
        script = [(line, block) for line, block in blocks(page)]
        if not script:
            continue
        begun = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for name in ("examples", "models", "docs", "python", "benches"):
                shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=shutil.ignore_patterns("target", "node_modules"))
            (folder / "bin").mkdir()
            (folder / "bin" / "romc").symlink_to(pathlib.Path(romc).resolve())
            (folder / "target").mkdir()
            (folder / "target" / "release").mkdir()
            (folder / "target" / "release" / "romc").symlink_to(pathlib.Path(romc).resolve())
            environment = dict(os.environ, PATH=f"{folder / 'bin'}:{os.environ['PATH']}")
            text = "set -e\n" + "".join(f"echo '@{line}' >&2\n{block}" for line, block in script)
            done = subprocess.run(["bash", "-c", text], cwd=folder, env=environment, capture_output=True, text=True)
            if done.returncode:
                at = re.findall(r"^@(\d+)$", done.stderr, re.M)[-1]
                faults.append(f"{page.relative_to(ROOT)}:{at}: {done.stderr.strip().splitlines()[-1]}")
        print(f"{page.relative_to(ROOT)}: {len(script)} blocks, {time.monotonic() - begun:.0f} s", flush=True)
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=["generate", "check", "run"])
    parser.add_argument("pages", nargs="*")
    parser.add_argument("--romc", default=str(ROOT / "target/release/romc"))
    arguments = parser.parse_args()
    if arguments.action == "generate":
        for name, make in GENERATED.items():
            (DOCS / name).write_text(make(arguments.romc), encoding="utf-8")
        return
    faults = check(arguments.romc) if arguments.action == "check" else run(arguments.romc, arguments.pages)
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
