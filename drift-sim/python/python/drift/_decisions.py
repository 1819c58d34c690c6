"""What the monitor decides: single decisions, and all that fell while arrays were pushed."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, overload

from numpy.typing import NDArray

from . import _drift


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
    """Decisions in the order of time, read like a list.

    They stay with the monitor's own half; Python's objects are made of those that are asked for.
    """

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

    def to_dict(self) -> dict[str, NDArray[Any] | list[str]]:
        """All of them in columns, as a frame takes them.

        ``hop``, ``from_s``, ``to_s``, ``status``, ``verdict`` and ``location``, and of each channel its numbers and its verdict, like
        ``effort_z``: arrays of numpy and lists of text, made without an object for each decision.
        """
        return self._inner.columns()

    def __repr__(self) -> str:
        """In one line."""
        if not self:
            return "<Decisions: none>"
        return f"<Decisions: {len(self)}, the last {self[-1].verdict} at {self[-1].to_s:g} s>"


def _channel(fields: dict[str, Any]) -> Channel:
    numbers = {name: number_or_nan(fields[name]) for name in ("x", "value", "residual", "z")}
    return Channel(
        kind=fields["kind"],
        verdict=fields["verdict"],
        side=fields["side"],
        extrapolated=fields["extrapolated"],
        **numbers,
    )


def number_or_nan(value: float | None) -> float:
    """A number of the lines, in which one that is not there is null."""
    return float("nan") if value is None else value
