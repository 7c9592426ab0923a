"""The command line, as the wheel installs it."""

from __future__ import annotations

import signal
import sys

from romc import _romc


def main() -> None:
    """Runs `romc` with the process's arguments."""
    # Python would keep Ctrl-C until the command has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_romc.run_command(["romc", *sys.argv[1:]]))
