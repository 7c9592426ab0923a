"""Executes jump.ipynb and stores its outputs; needs ipykernel, nbclient and matplotlib.

    python python/examples/run_notebook.py              # in place
    python python/examples/run_notebook.py other.ipynb  # into another file
"""
import copy
import pathlib
import sys
import tempfile

import nbclient
import nbformat

SOURCE = pathlib.Path(__file__).with_name("jump.ipynb")


def executed() -> nbformat.NotebookNode:
    """The notebook with fresh outputs, run in an empty folder."""
    notebook = nbformat.read(SOURCE, as_version=4)
    metadata = copy.deepcopy(notebook.metadata)
    with tempfile.TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        options = {"timeout": 300, "kernel_name": "python3", "resources": resources}
        # The same outputs in every run: no times, and printed text in one piece.
        options |= {"record_timing": False, "coalesce_streams": True}
        nbclient.NotebookClient(notebook, **options).execute()
    # The kernel has added its version.
    notebook.metadata = metadata
    return notebook


if __name__ == "__main__":
    target = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else SOURCE
    nbformat.write(executed(), target)
