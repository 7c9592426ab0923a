#!/usr/bin/env python3
"""Counts habits of language and lengths of sentences in all pages, in the helps of the command line and in messages.

    .ci/english.py [--list] [--romc target/release/romc] [FILE.md ...]

Without files: README.md, CHANGELOG.md, ARCHITECTURE.md, CONTRIBUTING.md and everything below docs/; the other pages that
git lists; the messages in src/; with --romc the help of every command. Of messages only habits are counted. Ends with 1
where a limit is exceeded; --list prints each place.
"""
import argparse
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Habit: regular expression (case does not matter), most occurrences in pages or in helps.
# Questions are not searched for "what".
HABITS = {
    "free relative (what)": (r"\bwhat(ever)?\b(?! to\b)", 20),
    "take": (r"\b(take|takes|taking|took|taken)\b", 10),
    "unless given": (r"\bunless (it is |they are )?given\b", 0),
    "say, tell, know": (r"\b(says?|said|saying|tells?|told|knows|knew|knowing)\b", 20),
    "off by": (r"\b(is|are|be|was|were|far|farther) off\b|\boff (by|after)\b", 5),
    "beside": (r"\bbesides?\b", 10),
    "trailing too": (r", too\b", 2),
    "for as because": (r", for (it|the|they|its|a|an|no)\b", 5),
    "very": (r"\bthe very\b", 0),
    "worth": (r"\bworth\b", 5),
    "before (history)": (r"\bbefore\)", 0),
    "one a column": (r"\bone an? (row|column|file|line|step|operation|coordinate)\b", 0),
}
# Messages have none of them. Their figures are pictures, and metrics have that name.
MESSAGE_HABITS = {name: (pattern, 0) for name, (pattern, _) in HABITS.items()} | {"figures (metrics)": (r"\bfigures\b", 2)}
MEAN_WORDS, LONG_WORDS, LONG_SHARE, LONGEST_WORDS, README_WORDS = 18.0, 25, 0.05, 40, 25
ABBREVIATION = re.compile(r"\b(e\.g|i\.e|etc|cf|vs|al|Fig|Eq|Sec|No|approx)\.$")


def paragraphs(text):
    """Yields (line number, text) of paragraphs and list items, without code, tables, headings and comments."""
    blank = lambda found: re.sub(r"[^\n]", " ", found.group(0))
    text = re.sub(r"<!--.*?-->", blank, text, flags=re.S)
    text = re.sub(r"^( *)(`{3,}|~{3,}).*?^ *\2 *$", blank, text, flags=re.S | re.M)
    text = re.sub(r"\$\$.*?\$\$", blank, text, flags=re.S)
    start, lines = 0, []
    for number, line in enumerate(text.split("\n") + [""], 1):
        bare = line.strip()
        is_break = not bare or re.match(r"(#|\||\{\{#|!\[|<|-{3,}$|={3,}$)", bare)
        item = re.match(r"\s*([-*+]|\d+[.)])\s+(.*)", line)
        if (is_break or item) and lines:
            yield start, " ".join(lines)
            lines = []
        if is_break:
            continue
        if not lines:
            start = number
        lines.append(item.group(2) if item else bare)


def plain(text):
    """Text without Markdown: code, formulas and addresses count as one word each."""
    text = re.sub(r"`+[^`]*`+", "CODE", text)
    text = re.sub(r"\$[^$]+\$", "MATH", text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"<https?://[^>]*>|https?://\S+", "LINK", text)
    return re.sub(r"[*_]{1,2}(?=\w)|(?<=\w)[*_]{1,2}", "", text)


def sentences(text):
    found, begin = [], 0
    for end in re.finditer(r"[.!?]+[\")']*(?=\s|$)", text):
        piece = text[begin : end.end()].strip()
        if ABBREVIATION.search(piece):
            continue
        begin = end.end()
        found.append(piece)
    rest = text[begin:].strip()
    return [piece for piece in found + [rest] if piece]


def words(sentence):
    return sum(1 for word in sentence.split() if re.search(r"\w", word))


class Counts:
    def __init__(self, limits=HABITS, has_lengths=True):
        self.limits, self.has_lengths = limits, has_lengths
        self.habits = {name: [] for name in limits}
        self.sentences = []

    def add(self, name, text):
        for line, paragraph in paragraphs(text):
            for sentence in sentences(plain(paragraph)):
                self.add_sentence(f"{name}:{line}", sentence)

    def add_sentence(self, place, sentence):
        self.sentences.append((words(sentence), place, sentence))
        for habit, (pattern, _) in self.limits.items():
            if habit.startswith("free relative") and sentence.endswith("?"):
                continue
            for found in re.finditer(pattern, sentence, re.I):
                self.habits[habit].append((place, sentence, found.group(0)))

    def judge(self, title, list_all):
        lengths = [count for count, _, _ in self.sentences] or [0]
        mean, long = sum(lengths) / len(lengths), [s for s in self.sentences if s[0] > LONG_WORDS]
        share = len(long) / len(lengths)
        faults = []
        print(f"{title}: {len(lengths)} sentences, {sum(lengths)} words")
        rows = [(name, len(places), self.limits[name][1]) for name, places in self.habits.items()]
        if self.has_lengths:
            readme = [count for count, place, _ in self.sentences if place.startswith("README.md")]
            rows += [
                ("mean words of a sentence", round(mean, 1), MEAN_WORDS),
                (f"share over {LONG_WORDS} words, %", round(100 * share, 1), 100 * LONG_SHARE),
                ("longest sentence, words", max(lengths), LONGEST_WORDS),
                ("README, longest sentence", max(readme or [0]), README_WORDS),
            ]
        for name, value, limit in rows:
            is_exceeded = value > limit
            print(f"  {name:28} {value:>7}  at most {limit:>5g}{'  EXCEEDED' if is_exceeded else ''}")
            if is_exceeded:
                faults.append(f"{title}: {name} {value}, at most {limit:g}")
        if list_all:
            for name, places in self.habits.items():
                for place, sentence, found in places:
                    print(f"    {place}: [{found}] {sentence[:160]}")
            for count, place, sentence in sorted(self.sentences if self.has_lengths else [], reverse=True):
                limit = README_WORDS if place.startswith("README.md") else LONG_WORDS
                if count > limit:
                    print(f"    {place}: {count} words: {sentence[:160]}")
        return faults


def helps(romc):
    """The helps of all commands, options' texts as paragraphs."""
    def run(*arguments):
        return subprocess.run([romc, *arguments], capture_output=True, text=True, check=True).stdout

    top = run("--help")
    commands = re.findall(r"^  ([a-z][a-z-]*)  +\S", top[top.index("Commands:") :], re.M)
    for command in [c for c in commands if c != "help"]:
        text, is_example = [], False
        for line in run(command, "--help").split("\n"):
            is_example = line.startswith(("Example", "Usage")) or (is_example and line.startswith("  "))
            bare = line.strip()
            if is_example or bare.endswith(":") and not line.startswith(" ") or re.match(r"-{1,2}[A-Za-z]|[<\[]", bare):
                # An option's own line, with its short text behind two spaces.
                short = re.match(r"\s*(-\S.*?|[<\[].*?)  +(\S.*)", line)
                text += ["", short.group(2) if short and not is_example else ""]
            else:
                text.append(bare)
        yield command, re.sub(r"\[(default|possible\s+values|aliases?|env):[^\]]*\]", "", "\n".join(text))


def messages():
    """Place and text of every string of the program with at least four words. The texts of helps are counted elsewhere."""
    skipped = r"//[^\n]*|'(?:\\.|[^\\'\n])'|r(#+)\".*?\"\1"
    for path in sorted((ROOT / "src").rglob("*.rs")):
        if "src/cli/args" in path.as_posix():
            continue
        source = path.read_text(encoding="utf-8")
        for found in re.finditer(rf'{skipped}|"((?:\\.|[^"\\])*)"', source, re.S):
            text = re.sub(r"\\\n\s*", "", found.group(2) or "")
            text = re.sub(r"\\.", " ", re.sub(r"\{[^{}]*\}", "x", text))
            if words(text) >= 4:
                line = source.count("\n", 0, found.start()) + 1
                yield f"{path.relative_to(ROOT)}:{line}", text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=pathlib.Path)
    parser.add_argument("--list", action="store_true", help="print each place")
    parser.add_argument("--romc", help="the command line whose helps are counted")
    arguments = parser.parse_args()
    docs = [ROOT / name for name in ("README.md", "CHANGELOG.md", "ARCHITECTURE.md", "CONTRIBUTING.md")]
    docs += sorted((ROOT / "docs").rglob("*.md"))
    tracked = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    others = [path for path in map(ROOT.joinpath, tracked.split()) if path not in docs and not path.is_symlink()]
    faults = []
    for title, files in [("files", arguments.files)] if arguments.files else [("documentation", docs), ("other pages", others)]:
        pages = Counts()
        for path in map(pathlib.Path.resolve, files):
            name = str(path.relative_to(ROOT)) if path.is_relative_to(ROOT) else str(path)
            pages.add(name, path.read_text(encoding="utf-8"))
        faults += pages.judge(title, arguments.list)
    if not arguments.files:
        texts = Counts(MESSAGE_HABITS, has_lengths=False)
        for place, text in messages():
            texts.add_sentence(place, text)
        faults += texts.judge("messages", arguments.list)
    if arguments.romc:
        texts = Counts()
        for command, text in helps(arguments.romc):
            texts.add(f"romc {command} --help", text)
        faults += texts.judge("helps", arguments.list)
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
