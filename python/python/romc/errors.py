"""The errors of the package; all are also `ValueError`."""

from __future__ import annotations

import re
import sys
import warnings
from typing import Optional, Union

# Words of messages after an option that are not its value.
_PROSE = "alone and are as decide depends describes does has is leaves names only or part replaces to with without"
_NO_VALUE = rf"(?:{_PROSE.replace(' ', '|')})\b"
_OPTION = re.compile(rf"--([a-z]+(?:-[a-z]+)*)(?: (?!{_NO_VALUE})([\w.,=-]*\w))?")

# Options without a value.
_FLAGS = {
    "as_learned",
    "exact",
    "force",
    "leave_out_implausible",
    "no_rotation",
    "paper",
    "siunitx",
    "trigonometric",
    "unchecked",
}


def in_python(message: str) -> str:
    """The message with options of the command line as keyword arguments: `--xi-layout X` as `xi_layout="X"`."""

    def named(match: re.Match[str]) -> str:
        name = match.group(1).replace("-", "_")
        return {"from": "from_", "lambda": "lambda_", "phase": "phases"}.get(name, name)

    def argument(match: re.Match[str]) -> str:
        name, value = named(match), match.group(2)
        if name in _FLAGS:
            following = "" if value is None else f" {value}"
            return f"{name}=True{following}"
        if value is None:
            return f"{name}="
        left, equals, right = value.partition("=")
        if equals and name in ("phases", "map"):
            return f'{name}={{"{left}": "{right}"}}'
        return f'{name}="{value}"'

    message = re.sub(r"(a tensor|tensors) mean\.state and std\.state", "mean= and std=", message)
    message = message.replace("--unchecked writes", "unchecked=True accepts")
    message = message.replace("--library FILE with the list of terms", "library=[...], the list of terms")
    message = re.sub(r"a tensor (mean|std)\.state", r"\1=", message)
    # The command line's parser: invalid value 'x' for '--latent-dim <D>', then its possible values.
    message = re.sub(r"'--([a-z-]+)(?: <[^>]*>)?(?:\.\.\.)?'", named, message)
    message = re.sub(r"\n +\[possible values: ([^\]]*)\]", r": expected one of \1", message)
    # Indented lines are to be typed as they are.
    lines = message.splitlines()
    return "\n".join(line if line.startswith("    ") else _OPTION.sub(argument, line) for line in lines)


class RomcError(ValueError):
    """Anything that romc refuses.

    Attributes that do not apply are `None`:

    - `file`: the file, or the constructor that got the arrays;
    - `tensor`: the array or the key of the model file, such as `encoder.weight` or `phases[0].xi`;
    - `row`, `column`: where. For tensors indices from 0, as in NumPy. For recordings the row of the file, from 1
      with the header (of arrays the sample, from 0), and the column's name.
    """

    file: Optional[str]
    tensor: Optional[str]
    row: Optional[int]
    column: Optional[Union[int, str]]

    def __init__(
        self,
        message: str,
        *,
        file: Optional[str] = None,
        tensor: Optional[str] = None,
        row: Optional[int] = None,
        column: Optional[Union[int, str]] = None,
    ) -> None:
        super().__init__(in_python(message))
        self.file = file
        self.tensor = tensor
        self.row = row
        self.column = column


class ModelError(RomcError):
    """A model, or a part of one, that cannot be used, with `tensor`, `row` and `column` of the fault."""


class RecordingError(RomcError):
    """A recording or reference that cannot be used, with `file`, `row` and `column` of the fault."""


class RomcWarning(UserWarning):
    """Repairs of data, and doubts about data that romc nevertheless accepts."""


def warn(message: str) -> None:
    """Warns the caller of the package."""
    level = 2
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "romc":
        frame, level = frame.f_back, level + 1
    warnings.warn(in_python(message), RomcWarning, stacklevel=level)
