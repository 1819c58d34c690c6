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
from ._recording import Data, Reading, as_recording
from ._result import Answer, Result


@dataclass(frozen=True)
class Channel:
    """What one channel said at a decision.

    Attributes
    ----------
    kind
        ``energy_error``, ``effort``, ``motion_effort`` or ``activity``.
    x, value
        The index that it is compared by, and its value; NaN where the window did not count.
    residual, z
        Distance of the value from the healthy line, in its unit and in sigmas.
    verdict
        ``healthy``, ``disturbance``, ``recovered``, ``suspect`` or ``drift``.
    side
        ``high`` or ``low``; None while nothing is away.
    extrapolated
        Whether x lies outside what calibration saw.
    """

    kind: str
    x: float
    value: float
    residual: float
    z: float
    verdict: str
    side: str | None
    extrapolated: bool


class Decision:
    """One decision of the monitor and the window that it is about.

    Attributes
    ----------
    hop
        Its number, from 0.
    from_s, to_s
        Begin and end of the window, s on the recording's clock.
    status
        ``valid`` or ``too_few_valid``.
    verdict
        The worst of the channels'.
    location
        Where in the loop the deviation shows.
    channels
        What each channel said.
    """

    _line: str

    def __init__(self, line: str) -> None:
        self._line = line

    @cached_property
    def _fields(self) -> dict[str, Any]:
        """Read when it is first asked for: most decisions never are."""
        return dict(json.loads(self._line))

    @property
    def hop(self) -> int:
        """Its number, from 0."""
        return int(self._fields["hop"])

    @property
    def from_s(self) -> float:
        """Begin of the window, s."""
        return float(self._fields["from_s"])

    @property
    def to_s(self) -> float:
        """End of the window, s."""
        return float(self._fields["to_s"])

    @property
    def status(self) -> str:
        """``valid`` or ``too_few_valid``."""
        return str(self._fields["status"])

    @property
    def verdict(self) -> str:
        """The worst of the channels'."""
        return str(self._fields["verdict"])

    @property
    def location(self) -> str:
        """Where in the loop the deviation shows."""
        return str(self._fields["location"])

    @cached_property
    def channels(self) -> list[Channel]:
        """What each channel said."""
        return [_channel(fields) for fields in self._fields["channels"]]

    def to_dict(self) -> dict[str, Any]:
        """The line that ``drift monitor --json`` writes."""
        return self._fields

    def __repr__(self) -> str:
        """In one line."""
        return f"<Decision {self.hop}: {self.verdict}, {self.from_s:g} to {self.to_s:g} s>"


class Decisions(Sequence[Decision]):
    """Decisions in the order of time, read like a list; text is made of those that are looked at."""

    _inner: _drift.Decisions

    def __init__(self, inner: _drift.Decisions) -> None:
        self._inner = inner

    def __len__(self) -> int:
        """How many they are."""
        return len(self._inner)

    @overload
    def __getitem__(self, index: int) -> Decision: ...
    @overload
    def __getitem__(self, index: slice) -> list[Decision]: ...
    def __getitem__(self, index: int | slice) -> Decision | list[Decision]:
        """One of them, or a list of several."""
        places = range(len(self))[index]
        if isinstance(places, range):
            return [Decision(self._inner.line(place)) for place in places]
        return Decision(self._inner.line(places))

    def __repr__(self) -> str:
        """In one line."""
        return f"<Decisions: {len(self)}>"


def _channel(fields: dict[str, Any]) -> Channel:
    numbers = {name: _number(fields[name]) for name in ("x", "value", "residual", "z")}
    return Channel(
        kind=fields["kind"],
        verdict=fields["verdict"],
        side=fields["side"],
        extrapolated=fields["extrapolated"],
        **numbers,
    )


def _number(value: float | None) -> float:
    return float("nan") if value is None else value


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
    >>> len(monitor.push(healthy.r[200:], healthy.y[200:], healthy.u[200:]))
    399
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
    array = np.asarray(signal)
    return array if array.dtype in (np.float64, np.float32) else array.astype(np.float64)


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
        return [Event(max_z=_number(row["max_z"]), **{name: row[name] for name in names}) for row in rows]

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
