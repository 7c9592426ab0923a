"""The command line, as the wheel installs it, and its commands inside Python."""

from __future__ import annotations

import difflib
import json
import numbers
import os
import signal
import sys
from typing import Any, Dict, Iterable, List, Mapping, NamedTuple, Optional, Tuple, Type

from romc import _romc
from romc.errors import RomcError, warn
from romc.recording import Recording, Recordings, listed, some


def main() -> None:
    """Runs `romc` with the process's arguments."""
    # Python would keep Ctrl-C until the command has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_romc.run_command(["romc", *sys.argv[1:]]))


class Answer(NamedTuple):
    """Object of `--json` and printed text of a command, and the model of a training."""

    summary: Dict[str, Any]
    text: str
    model: Optional["_romc.Model"]


class Arguments:
    """Arguments of a command; recordings in memory go with them under their names."""

    def __init__(self, command: str) -> None:
        self._command = command
        self._flags: List[str] = []
        self._files: List[str] = []
        self._held: Dict[str, "_romc.Recording"] = {}

    def file(self, path: str) -> "Arguments":
        """A file by its place in the command."""
        self._files.append(path)
        return self

    def recordings(self, recordings: Recordings, flag: str = "") -> "Arguments":
        """Recordings by their place in the command, or behind a flag."""
        for entry in listed(recordings) if flag else some(recordings):
            name = self._name(entry) if isinstance(entry, Recording) else os.fspath(entry)
            if flag:
                self._flags.append(f"--{flag}={name}")
            else:
                self._files.append(name)
        return self

    def options(self, **options: Any) -> "Arguments":
        """Options by their names with underscores: `True` is a flag, `None` and `False` none."""
        for name, value in options.items():
            self._flags += _flags(name, value)
        return self

    def run(self, model: Optional["_romc.Model"] = None) -> Answer:
        """Runs the command; its notes become warnings."""
        arguments = ["romc", self._command, *self._flags, "--", *self._files]
        summary, text, notes, trained = _romc.command(arguments, list(self._held.items()), model)
        for note in notes:
            warn(note)
        return Answer(json.loads(summary), text, trained)

    def _name(self, recording: Recording) -> str:
        """The recording's own name, with a number where another has it."""
        name, number = recording.path, 1
        while self._held.get(name, recording._native) is not recording._native:
            number += 1
            name = f"{recording.path}-{number}"
        self._held[name] = recording._native
        return name


def _flags(name: str, value: Any) -> List[str]:
    flag = "--" + name.replace("_", "-")
    if value is None or value is False:
        return []
    if value is True:
        return [flag]
    if isinstance(value, Mapping):
        return [f"{flag}={key}={_text(of_key)}" for key, of_key in value.items()]
    return [f"{flag}={_text(value)}"]


def _text(value: Any) -> str:
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if isinstance(value, Iterable):
        return ",".join(_text(entry) for entry in value)
    raise RomcError(f"found {value!r}, expected a number, a word, a path, a list of them, or True")


def check_names(function: str, given: Mapping[str, Any], known: Type[Any], own: Tuple[str, ...]) -> None:
    """Refuses an option that a function does not have, with the most similar one that it has."""
    names = [*own, *known.__annotations__]
    for name in given:
        if name not in names:
            similar = difflib.get_close_matches(name, names, 1)
            remedy = f"did you mean `{similar[0]}`?" if similar else f"expected one of {', '.join(sorted(names))}"
            raise RomcError(f"{function}: found the option `{name}`; {remedy}")
