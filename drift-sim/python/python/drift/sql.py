"""drift's functions in the SQL of Python's `datafusion` package: ``drift_verdict`` and ``drift_block``.

They are named and answer as in ``drift fleet sql``, which is the door for data that don't fit into memory: here the engine hands a loop's
samples over in pieces and in any order, so that they are held until the loop is complete.
"""

import os
from typing import Any

import numpy as np
import pyarrow
from datafusion import Accumulator, SessionContext, udaf
from numpy.typing import NDArray

from . import _drift
from ._monitoring import Event, Monitoring, monitor
from ._recording import Recording

__all__ = ["baseline_path", "register"]

# From the least severe on.
_KINDS = ("disturbance", "suspect", "drift")
_NUMBER, _TEXT, _COUNT = pyarrow.float64(), pyarrow.string(), pyarrow.int64()
_SIGNALS = [_NUMBER] * 4
_ROWS = [_TEXT, _TEXT, *_SIGNALS]
_TOLD_OF_A_LOOP = pyarrow.struct(
    {
        "status": _TEXT,
        "since_s": _NUMBER,
        "events": _COUNT,
        "samples": _COUNT,
        "hours": _NUMBER,
        "answer": _TEXT,
        "summary": _TEXT,
    }
)
_SUMS = ("samples", "from_s", "to_s", "r", "y", "u", "e", "abs_e", "e2", "u2", "least_y", "greatest_y", "least_u", "greatest_u")
_MEANS = {"mean_r": "r", "mean_y": "y", "mean_u": "u", "mean_e": "e", "mean_abs_e": "abs_e", "mean_u2": "u2"}
_TOLD = (
    *("samples", "from_s", "to_s", "mean_r", "mean_y", "mean_u", "mean_e", "mean_abs_e", "rms_e", "mean_u2"),
    *("least_y", "greatest_y", "least_u", "greatest_u"),
)
_TOLD_OF_A_BLOCK = pyarrow.struct(dict.fromkeys(_TOLD, _NUMBER))


def register(context: SessionContext) -> None:
    """Makes ``drift_verdict`` and ``drift_block`` known to a session.

    ``drift_verdict(baselines, loop, t, r, y, u)`` judges a loop's samples by its baseline, the file ``LOOP.toml`` in the folder `baselines` that
    ``drift fleet calibrate`` writes: a struct of ``status``, ``since_s``, ``events``, ``samples``, ``hours``, ``answer`` and ``summary``, the last
    line of ``drift monitor --json``. The rows may come in any order. ``drift_block(t, r, y, u)`` gives a block's counts, means and extremes.
    Times are numbers of seconds; ``to_unixtime(stamp)`` makes them of time stamps.

    Parameters
    ----------
    context
        The session; ``datafusion.SessionContext()``.

    Examples
    --------
    >>> import datafusion, drift.sql
    >>> context = datafusion.SessionContext()
    >>> drift.sql.register(context)
    >>> lake = context.from_pydict({"t": [0.0, 1.0], "r": [5.0, 5.0], "y": [4.0, 5.0], "u": [1.0, 3.0]}, name="lake")
    >>> context.sql("SELECT drift_block(t, r, y, u)['mean_abs_e'] AS error FROM lake").to_pydict()
    {'error': [0.5]}
    """
    # Rows on their way from one part of the engine to another: of each column a list.
    held = [pyarrow.list_(kind) for kind in _ROWS]
    context.register_udaf(udaf(_Verdict, _ROWS, _TOLD_OF_A_LOOP, held, "stable", name="drift_verdict"))
    sums = [_NUMBER] * len(_SUMS)
    context.register_udaf(udaf(_Block, _SIGNALS, _TOLD_OF_A_BLOCK, sums, "immutable", name="drift_block"))


def baseline_path(folder: str | os.PathLike[str], loop: str) -> str:
    """Where a loop's baseline lies: what is no letter, digit, ``.``, ``_`` or ``-`` of its name is ``%`` and two hexadecimal digits a byte.

    Examples
    --------
    >>> import drift.sql
    >>> drift.sql.baseline_path("baselines", "boiler 2/FIC-101")
    'baselines/boiler%202%2FFIC-101.toml'
    """
    plain = b"_-" + bytes(range(48, 58)) + bytes(range(65, 91)) + bytes(range(97, 123))
    stem = [
        chr(byte) if byte in plain or (byte == ord(".") and place > 0) else f"%{byte:02X}"
        for place, byte in enumerate(loop.encode())
    ]
    return os.path.join(folder, "".join(stem) + ".toml")


class _Verdict(Accumulator):
    """One loop: its rows, and in the end what the monitor says of them."""

    def __init__(self) -> None:
        self._parts: list[list[Any]] = []

    def update(self, *columns: Any) -> None:
        """Further rows."""
        self._parts.append(list(columns))

    def state(self) -> list[Any]:
        """The rows so far, one list a column."""
        offsets = pyarrow.array([0, sum(len(part[0]) for part in self._parts)], pyarrow.int32())
        return [pyarrow.ListArray.from_arrays(offsets, column)[0] for column in self._columns()]

    def merge(self, states: list[Any]) -> None:
        """Rows that another one held."""
        for row in range(len(states[0])):
            part = [column[row].values for column in states]
            if len(part[0]) > 0:
                self._parts.append(part)

    def evaluate(self) -> Any:
        """What the monitor says; null of no rows."""
        if not self._parts:
            return pyarrow.scalar(None, _TOLD_OF_A_LOOP)
        folders, loops, *signals = self._columns()
        arrays = [column.to_numpy(zero_copy_only=False) for column in signals]
        return pyarrow.scalar(_verdict(folders[0].as_py(), loops[0].as_py(), arrays), _TOLD_OF_A_LOOP)

    def _columns(self) -> list[Any]:
        if not self._parts:
            return [pyarrow.array([], kind) for kind in _ROWS]
        return [pyarrow.concat_arrays(column) for column in zip(*self._parts, strict=True)]


def _verdict(folder: str | None, loop: str | None, signals: list[NDArray[np.float64]]) -> dict[str, Any]:
    """The fields of a verdict."""
    if folder is None or loop is None:
        return {"status": "error", "answer": "rows that name no loop or no folder of baselines"}
    path = baseline_path(folder, loop)
    if not os.path.exists(path):
        return {"status": "no_baseline", "answer": f"{path} is missing"}
    order = np.argsort(signals[0], kind="stable")
    try:
        recording = Recording(*(signal[order] for signal in signals), name=loop)
        found = monitor(recording, path)
    except _drift.DriftError as error:
        return {"status": "error", "answer": str(error)}
    worst = _worst(found)
    return {
        "status": found.verdict,
        "since_s": None if worst is None else worst.from_s,
        "events": len(found.events) + found.summary["more_events"],
        "samples": found.summary["samples"],
        "hours": found.summary["duration_s"] / 3600,
        "answer": found.answer.sentence,
        "summary": found._lines[-1],
    }


def _worst(found: Monitoring) -> Event | None:
    """The most severe event, among those one that lasts, among those the last."""
    severity = [(_KINDS.index(event.kind), event.to_s is None, place) for place, event in enumerate(found.events)]
    return found.events[max(severity)[2]] if severity else None


class _Block(Accumulator):
    """Sums of a block; samples that are not numbers enter none."""

    def __init__(self) -> None:
        self._sums: dict[str, float] = {}

    def update(self, *columns: Any) -> None:
        """Further samples."""
        t, r, y, u = (column.to_numpy(zero_copy_only=False) for column in columns)
        e = r - y
        valid = np.isfinite(e + u)
        if not valid.any():
            return
        t, r, y, u, e = (signal[valid] for signal in (t, r, y, u, e))
        sums = (len(t), t.min(), t.max(), r.sum(), y.sum(), u.sum(), e.sum(), np.abs(e).sum(), (e * e).sum(), (u * u).sum())
        self._add(dict(zip(_SUMS, map(float, (*sums, y.min(), y.max(), u.min(), u.max())), strict=True)))

    def state(self) -> list[Any]:
        """The sums so far."""
        return [pyarrow.scalar(self._sums.get(name), _NUMBER) for name in _SUMS]

    def merge(self, states: list[Any]) -> None:
        """Sums of others."""
        for row in zip(*(column.to_pylist() for column in states), strict=True):
            if row[0] is not None:
                self._add(dict(zip(_SUMS, row, strict=True)))

    def _add(self, sums: dict[str, float]) -> None:
        for name, value in sums.items():
            if name not in self._sums:
                self._sums[name] = value
            elif name == "from_s" or name.startswith("least"):
                self._sums[name] = min(self._sums[name], value)
            elif name == "to_s" or name.startswith("greatest"):
                self._sums[name] = max(self._sums[name], value)
            else:
                self._sums[name] += value

    def evaluate(self) -> Any:
        """Counts, means and extremes; null where there is no valid sample."""
        count = self._sums.get("samples")
        told = {name: self._sums.get(name) for name in _TOLD}
        if count is not None:
            told.update({name: self._sums[total] / count for name, total in _MEANS.items()})
            told["rms_e"] = float(np.sqrt(self._sums["e2"] / count))
        return pyarrow.scalar(told, _TOLD_OF_A_BLOCK)
