"""Models, and models by size, learned from recordings."""

from __future__ import annotations

import csv
import importlib
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, Iterable, List, Optional, Union

from romc._command import Arguments, check_names
from romc._options import StudyOptions, TrainOptions
from romc.errors import RomcError, in_python
from romc.model import Model
from romc.recording import PathLike, Recordings

if TYPE_CHECKING:
    from typing_extensions import Unpack

Row = Dict[str, Any]


def train(
    recordings: Recordings,
    *,
    latent_dim: Optional[int] = None,
    validation: Recordings = (),
    test: Recordings = (),
    from_: Union[Model, PathLike, None] = None,
    name: str = "model",
    **options: Unpack[TrainOptions],
) -> Model:
    """Learns a model from recordings, as `romc train` does.

    - `recordings`: files or `Recording` objects to learn from. Files are read as the command reads them, `Recording`
      objects are used as they are;
    - `latent_dim`: number of latent coordinates, d;
    - `validation`: recordings that choose between candidate models;
    - `test`: recordings that training does not use; their metrics are in `model.training["test"]`;
    - `from_`: a model to refine on these recordings, of hardware or of another robot, in place of a new one.

    Options have the names and defaults of the command line: `robot` (`"go1"` by default, `"go2"`, `"a1"`, a `.toml` or
    `.urdf` file), `method` (`"closed-form"` or `"joint"`), `split=(14, 3, 3)` in place of `validation` and `test`,
    `phases="trot"` or `{"rear": ["0011", "0001"]}`, `terms=["1", "z1", "u1"]`, `encoder_layers=(32, 16)`, ...;
    `romc train --help` has them all. Ctrl-C raises `KeyboardInterrupt`.

    >>> model = romc.train(files, validation=others, latent_dim=4)
    >>> model.training["report"]["validation"]["prediction_z_m"]     # error of body z over 0.1 s, m

    Raises `RomcError` with the option, `RecordingError` with `file` and `row`.
    """
    given: Dict[str, Any] = dict(options)
    own = ("latent_dim", "validation", "test", "from_", "name")
    check_names("train", given, TrainOptions, own)
    if latent_dim is None and from_ is None and "config" not in given:
        raise RomcError("latent_dim: found none, expected a number of latent coordinates, for example latent_dim=4")
    phases, terms = given.pop("phases", None), given.pop("terms", None)
    arguments = Arguments("train").recordings(recordings)
    arguments.recordings(validation, "validation").recordings(test, "test")
    output = Path(f"{name}.json")
    arguments.options(**given, latent_dim=latent_dim, name=None if output.stem == name else name, output=output)
    arguments.options(**({"phases": phases} if isinstance(phases, str) else {"phase": phases}))
    arguments.options(terms=terms if terms is None or isinstance(terms, str) else "; ".join(terms))
    base = None
    if isinstance(from_, Model):
        base, from_ = from_._native, f"{from_.name}.json"
    answer = arguments.options(**{"from": from_}).run(base)
    assert answer.model is not None, "a training that ends without an error has a model"
    return Model(answer.model, training=answer.summary)


def study(
    recordings: Recordings,
    *,
    validation: Recordings = (),
    latent_dims: Union[str, int, Iterable[int], None] = None,
    seeds: int = 5,
    out_dir: Optional[PathLike] = None,
    per: str = "dimension",
    as_frame: Optional[bool] = None,
    **options: Unpack[StudyOptions],
) -> Any:
    """Trains models of several latent dimensions with several seeds, as `romc study` does: accuracy against size.

    - `latent_dims`: `4`, `[2, 4, 6]`, `range(1, 8)` or `"1..7"`; by default 1 to 9, the most rows of an encoder with
      named coordinates;
    - `seeds`: trainings per dimension. The closed form leaves out other jumps with each seed;
    - `out_dir`: keeps the trainings, tables and figures; a study that was stopped goes on there. By default nothing is
      kept;
    - `per`: rows of the table, one per `"dimension"` (columns `latent_dim`, `trained`, `refused`, and `_mean` and
      `_std` over seeds of `decoder_mse`, `active`, `combined_loss`, `torque_r2`, `prediction_x_m`, `prediction_z_m`)
      or one per `"training"` (`seed`, the same metrics, and `refused`, the reason without a model);
    - `as_frame`: whether the table is a pandas `DataFrame`, else a list of dicts; by default if pandas is installed.

    Options are `method`, `paper`, `robot`, `config`, `lambda_`, `shard`, `columns`, `clock`, as on the command line.
    """
    given: Dict[str, Any] = dict(options)
    own = ("validation", "latent_dims", "seeds", "out_dir", "per", "as_frame")
    check_names("study", given, StudyOptions, own)
    tables = {"dimension": "summary.csv", "training": "cells.csv"}
    if per not in tables:
        raise RomcError(f'per: found {per!r}, expected "dimension" or "training"')
    given["lambda"] = given.pop("lambda_", None)
    arguments = Arguments("study").recordings(recordings).recordings(validation, "validation")
    arguments.options(**given, latent_dims=latent_dims, seeds=seeds)
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder if out_dir is None else os.fspath(out_dir))
        arguments.options(out_dir=kept).run()
        table = _read_table(kept / tables[per])
    return _framed(table, as_frame)


def _read_table(path: Path) -> List[Row]:
    with path.open(newline="", encoding="utf-8") as file:
        return [{name: _cell(text) for name, text in row.items()} for row in csv.DictReader(file)]


def _cell(text: str) -> Union[int, float, str, None]:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return in_python(text) or None


def _framed(table: List[Row], as_frame: Optional[bool]) -> Any:
    if as_frame is False:
        return table
    try:
        pandas = importlib.import_module("pandas")
    except ImportError:
        if as_frame:
            raise RomcError("as_frame=True needs pandas: pip install pandas") from None
        return table
    return pandas.DataFrame(table)
