"""The monitor: fed sample by sample, in arrays, or over a whole recording."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike, fspath
from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _drift
from ._calibration import Baseline, Calibration, as_baseline
from ._decisions import Decision, Decisions, number_or_nan
from ._recording import Data, Reading, as_recording
from ._result import Answer, Result


class Monitor:
    """drift's monitor, the one that runs on a controller: constant memory, a decision every hop.

    Parameters
    ----------
    baseline
        What the healthy loop looks like.
    sample_time_s
        From one sample to the next; the baseline's where nothing is said.
    start_s
        Time of the first sample, s.

    Examples
    --------
    >>> import drift
    >>> loop = drift.Loop.from_dict({
    ...     "loop": {"sample_time_s": 5.0},
    ...     "controller": {"kind": "pi", "kp": 4.0, "ki": 0.025},
    ...     "plant": {"kind": "first-order", "gain": 0.8, "time_constant_s": 180.0, "offset": 21.0},
    ...     "sensor": {"noise": 0.05},
    ... })
    >>> levels = dict(reference_mean=35.0, reference_sd=3.0, reference_hold=200)
    >>> healthy = drift.simulate(loop, duration_s=400_000, **levels).to_recording()
    >>> monitor = drift.Monitor(drift.calibrate(healthy, window_s=1000.0))
    >>> for r, y, u in zip(healthy.r[:200], healthy.y, healthy.u):
    ...     decision = monitor.push(r, y, u)
    >>> decision
    <Decision 0: healthy, 0 to 1000 s>
    >>> decisions = monitor.push(healthy.r[200:], healthy.y[200:], healthy.u[200:])
    >>> len(decisions), decisions[0].hop
    (399, 1)
    >>> decisions.to_dict()["effort_z"].shape
    (399,)
    """

    _inner: _drift.Monitor

    def __init__(
        self,
        baseline: Baseline | Calibration | str | PathLike[str],
        *,
        sample_time_s: float | None = None,
        start_s: float = 0.0,
    ) -> None:
        self._inner = _drift.Monitor(as_baseline(baseline)._inner, sample_time_s, start_s)

    @overload
    def push(self, r: float, y: float, u: float) -> Decision | None: ...
    @overload
    def push(
        self, r: Sequence[float] | NDArray[Any], y: Sequence[float] | NDArray[Any], u: Sequence[float] | NDArray[Any]
    ) -> Decisions: ...
    def push(self, r: Any, y: Any, u: Any) -> Decision | None | Decisions:
        """One sample, or arrays of samples one after the other.

        Arrays of float64 and of float32 are read where they are, without a copy; NaN is missing.

        Parameters
        ----------
        r, y, u
            Reference, measured output and controller output: three numbers, or three arrays of one length.

        Returns
        -------
        Decision or None, or Decisions
            Of one sample, the decision where one falls; of arrays, all that fall, read like a list.
        """
        if isinstance(r, np.number) and not isinstance(r, float):
            r, y, u = float(r), float(y), float(u)
        if isinstance(r, float | int):
            line = self._inner.push(r, y, u)
            return None if line is None else Decision(line)
        signals = [_array(signal) for signal in (r, y, u)]
        if any(signal.dtype != signals[0].dtype for signal in signals):
            signals = [signal.astype(np.float64) for signal in signals]
        return Decisions(self._inner.push_arrays(*signals))

    def push_manual(self) -> Decision | None:
        """One sample with the loop in manual: it enters no sum."""
        line = self._inner.push_manual()
        return None if line is None else Decision(line)

    def operating_point(self, *measured: float) -> None:
        """The measured operating point from the next sample on, one number for each column of the baseline."""
        self._inner.operating_point(measured)

    @property
    def samples(self) -> int:
        """Samples so far."""
        return self._inner.samples

    @property
    def time_s(self) -> float:
        """Time of the next sample, s."""
        return self._inner.time_s

    def __repr__(self) -> str:
        """In one line."""
        return f"<Monitor: {self.samples} samples so far, the next at {self.time_s:g} s>"


def _array(signal: ArrayLike) -> NDArray[Any]:
    if isinstance(signal, np.ma.MaskedArray):
        # What is masked is missing.
        signal = np.where(np.ma.getmaskarray(signal), np.nan, signal.data)
    array = np.asarray(signal)
    if array.dtype in (np.float64, np.float32):
        return array
    if array.dtype.kind == "c":
        raise TypeError("r, y and u are real numbers, not complex ones")
    return array.astype(np.float64)


@dataclass(frozen=True)
class Event:
    """A stretch in which the loop was away from its healthy relation.

    Attributes
    ----------
    kind
        ``disturbance``, ``suspect`` or ``drift``.
    from_s, alarm_s, to_s
        Its begin, its first alarm and its end, s; `to_s` is None where it was still open at the end.
    max_z
        Its largest deviation, sigmas.
    location
        Where in the loop it shows.
    """

    kind: str
    from_s: float
    alarm_s: float
    to_s: float | None
    max_z: float
    location: str


class Monitoring(Result):
    """What the monitor found in a whole recording."""

    _inner: _drift.Monitoring

    def __init__(self, inner: _drift.Monitoring) -> None:
        self._inner = inner

    @cached_property
    def _lines(self) -> list[str]:
        return self._inner.json_lines().splitlines()

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The summary that ``drift monitor --json`` writes as its last line."""
        return dict(json.loads(self._lines[-1])["summary"])

    @property
    def verdict(self) -> str:
        """``healthy``, ``disturbance``, ``suspect``, ``drift`` or ``not_judged``."""
        return str(self.summary["verdict"])

    @property
    def answer(self) -> Answer:
        """What it comes to."""
        return Answer._of(self.summary["answer"])

    @property
    def events(self) -> list[Event]:
        """Disturbances and drifts in the order of time."""
        names = ("kind", "from_s", "alarm_s", "to_s", "location")
        rows = self.summary["events"]
        return [Event(max_z=number_or_nan(row["max_z"]), **{name: row[name] for name in names}) for row in rows]

    @cached_property
    def decisions(self) -> list[Decision]:
        """Every decision."""
        return [Decision(line) for line in self._lines[:-1]]

    def to_dict(self) -> dict[str, Any]:
        """The summary."""
        return self.summary


def monitor(
    data: Data,
    baseline: Baseline | Calibration | str | PathLike[str],
    *,
    operating_point: Sequence[str] = (),
    **reading: Unpack[Reading],
) -> Monitoring:
    """Runs the monitor over a recording: tells disturbances from drift, and where they are.

    Parameters
    ----------
    data
        The recording; a file is read sample by sample in constant memory.
    baseline
        What the healthy loop looks like.
    operating_point
        The columns of the operating point where this recording names them otherwise than the baseline does.
    **reading
        How the recording is read; see `Reading`.

    Returns
    -------
    Monitoring
        Events and verdict, with every decision.
    """
    learnt, point = as_baseline(baseline), list(operating_point)
    if isinstance(data, str | PathLike):
        inner = _drift.watch(
            learnt._inner, recording=None, path=fspath(data), operating_point=point, reading=reading
        )
    else:
        recording = as_recording(data, reading, further=point or learnt.operating_point)
        inner = _drift.watch(
            learnt._inner, recording=recording._inner, path=None, operating_point=point, reading=None
        )
    return Monitoring(inner)
