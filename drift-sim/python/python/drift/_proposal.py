"""Loops proposed from recordings."""

from os import PathLike
from pathlib import Path
from typing import Any, Unpack

from . import _drift
from ._loop import Loop
from ._recording import Data, Reading, as_recording


class Proposal:
    """A loop proposed from a recording alone, with the reasons.

    Attributes
    ----------
    loop
        The loop. Its controller is ``recorded``, its plant ``identify``, where nothing was found.
    about_loop, about_controller, about_plant
        How each was found and how sure it is, a line each.
    window_s
        The window for `calibrate`, s; None where none was found.
    used_s
        Time of the first and the last sample that were used, s, where the loop was not closed all the time; else None.
    """

    _inner: _drift.Proposal

    def __init__(self, inner: _drift.Proposal) -> None:
        self._inner = inner
        self.loop = Loop._of(inner.model, "proposed")
        self.about_loop, self.about_controller, self.about_plant = inner.reasons
        self.window_s = inner.window_s
        self.used_s = inner.used_s

    def to_toml(self) -> str:
        """The loop file, the reasons as comments."""
        return self._inner.to_toml()

    def to_dict(self) -> dict[str, Any]:
        """The loop's tables."""
        return self.loop.to_dict()

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the loop file."""
        Path(path).write_text(self.to_toml(), encoding="utf-8")

    def __repr__(self) -> str:
        """The reasons in words."""
        return f"<Proposal>\n{self._inner.screen().strip()}"


def init(data: Data, **reading: Unpack[Reading]) -> Proposal:
    """Proposes a loop for a recording: the control law by replay, the plant by identification.

    Of a recording that is in manual at times, the longest stretch with the loop closed is used.

    Parameters
    ----------
    data
        The recording.
    **reading
        How it is read; see `Reading`.

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
    >>> proposal = drift.init(drift.simulate(loop, duration_s=20_000, **levels).to_recording())
    >>> proposal.loop.to_dict()["controller"]["kp"]
    4.0
    """
    return Proposal(_drift.propose(as_recording(data, reading)._inner))
