"""Looks at recordings as they are."""

from dataclasses import dataclass
from os import PathLike, fspath
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from . import _drift, _figure
from ._recording import Data, Reading, Recording
from ._table import is_table, named_columns


@dataclass(frozen=True)
class Stretch:
    """Rows one after the other: time of the first and of the last, s, and how many."""

    from_s: float
    to_s: float
    rows: int


class Overview:
    """What is in a recording, whatever is wrong with it.

    Attributes
    ----------
    name, format
        What it is called, and what kind of file it is.
    names
        All columns.
    columns
        Those that hold the signals, as far as they are known.
    lacks
        The signal that no column seems to be; None where none is missing.
    notes
        What was guessed, a line each.
    sample_time_s
        The sample time with which it can be read; None where it can't be read as it is, and `refused` says why.
    gaps
        Begin and length of each gap, s.
    repeated
        Rows at the time of the one before.
    manual
        Stretches in which the loop is not closed.
    at_lowest, at_highest
        Stretches in which u stays at its lowest, and at its highest value.
    """

    _inner: _drift.Overview

    def __init__(self, inner: _drift.Overview) -> None:
        self._inner = inner
        self.name, self.format, self.names = inner.name, inner.format, inner.names
        self.columns: dict[str, str | None] = dict(zip(("t", "r", "y", "u"), inner.columns, strict=True))
        self.lacks, self.notes = inner.lacks, inner.notes
        self.sample_time_s, self.refused = inner.sampling
        self.gaps, self.repeated = inner.gaps, inner.repeated
        self.manual = [Stretch(*stretch) for stretch in inner.manual]
        self.at_lowest, self.at_highest = ([Stretch(*one) for one in end] for end in inner.at_limit)

    def __getitem__(self, signal: str) -> NDArray[np.float64]:
        """t, r, y or u as they stand, row by row; NaN where a value is missing."""
        return self._inner.column(signal)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self["t"])

    def to_dict(self) -> dict[str, Any]:
        """What was seen, without the signals."""
        return {name: value for name, value in vars(self).items() if not name.startswith("_")}

    def plot(self) -> Any:
        """Draws r and y over u; a matplotlib figure."""
        return _figure.signals(self.name, self["t"], [("r", self["r"]), ("y", self["y"])], [("u", self["u"])])

    def __repr__(self) -> str:
        """One screen, with small charts."""
        return f"<Overview>\n{self._inner.screen().strip()}"


def look(data: Data, **reading: Unpack[Reading]) -> Overview:
    """Shows what is in a recording: rows, sample time, gaps, columns and what was guessed, manual and saturated stretches.

    Parameters
    ----------
    data
        A path, a table or a Recording.
    **reading
        How it is read; see `Reading`.

    Examples
    --------
    >>> import drift
    >>> seen = drift.look({"time": [0.0, 0.5, 1.0, 2.5], "SP": [1.0] * 4, "PV": [0.2, 0.6, 0.8, 0.9], "OP": [9, 5, 3, 2]})
    >>> seen.gaps
    [(1.0, 1.5)]
    >>> seen.columns["y"]
    'PV'
    """
    if isinstance(data, str | PathLike):
        return Overview(_drift.look(path=fspath(data), name="", named=None, reading=reading))
    name = "table"
    if hasattr(data, "to_recording"):
        # A simulated run.
        data = data.to_recording()
    if isinstance(data, Recording):
        name, data = data.name, data.to_dict()
    if not is_table(data):
        raise TypeError(f"{type(data).__name__} is no recording; a Recording, a path or a table")
    return Overview(_drift.look(path=None, name=name, named=named_columns(data), reading=reading))
