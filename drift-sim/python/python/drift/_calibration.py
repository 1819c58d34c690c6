"""Calibration: what a healthy loop looks like, and thresholds that keep a promise."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Literal, Self, Unpack

from . import _drift
from ._recording import Data, Reading, as_recording
from ._result import Answer, Result


class Baseline:
    """What a healthy loop looks like, with the thresholds made for it; what a monitor runs on.

    Made by `calibrate`, or read from the file that it or the command wrote.
    """

    _inner: _drift.Baseline

    def __init__(self) -> None:
        raise TypeError("a Baseline is made by drift.calibrate, Baseline.read or Baseline.from_toml")

    @classmethod
    def _of(cls, inner: _drift.Baseline) -> Self:
        made = cls.__new__(cls)
        made._inner = inner
        return made

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Self:
        """Reads a baseline file."""
        return cls._of(_drift.Baseline.read(fspath(path)))

    @classmethod
    def from_toml(cls, text: str, *, name: str = "baseline") -> Self:
        """Reads the text of a baseline file; errors call it by `name`."""
        return cls._of(_drift.Baseline.parse(text, name))

    def to_toml(self) -> str:
        """The text of the baseline file."""
        return self._inner.to_toml()

    def to_rust(self) -> str:
        """The same as a Rust constant, for firmware."""
        return self._inner.to_rust()

    def to_c(self) -> str:
        """The same as a C99 header, for firmware."""
        return self._inner.to_c()

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the baseline file."""
        Path(path).write_text(self.to_toml(), encoding="utf-8")

    @property
    def sample_time_s(self) -> float:
        """From one sample to the next, s."""
        return self._inner.sample_time_s

    @property
    def window_s(self) -> float:
        """Length of a window, s."""
        return self._inner.window_s

    @property
    def hop_s(self) -> float:
        """From one decision to the next, s."""
        return self._inner.hop_s

    @property
    def false_alarm_every_h(self) -> float | None:
        """The promised mean time between false alarms, hours; None where nothing was promised."""
        return self._inner.false_alarm_every_h

    @property
    def operating_point(self) -> list[str]:
        """The measured columns that the effort depends on besides y."""
        return self._inner.operating_point

    def __repr__(self) -> str:
        """In one line."""
        return f"<Baseline: windows of {self.window_s:g} s, a decision every {self.hop_s:g} s>"


def as_baseline(baseline: "Baseline | Calibration | str | PathLike[str]") -> Baseline:
    """A baseline of whatever a user holds."""
    if isinstance(baseline, Calibration):
        return baseline.baseline
    if isinstance(baseline, Baseline):
        return baseline
    if isinstance(baseline, str | PathLike):
        return Baseline.read(baseline)
    raise TypeError(f"{type(baseline).__name__} is no baseline; a Baseline, a Calibration, or a baseline file's path")


@dataclass(frozen=True)
class ChannelLine:
    """The healthy line of one channel: value = b0 + b1*x.

    Attributes
    ----------
    kind
        ``energy_error``, ``effort``, ``motion_effort`` or ``activity``.
    b0, b1
        The line, with ``b0_ci95`` and ``b1_ci95`` their 95 % intervals.
    r2
        Share of the values' variance that it explains.
    rmse
        Scatter around it, in the unit of the value.
    n
        Windows that it was learnt from, and ``n_effective`` the independent ones that they are worth.
    """

    kind: str
    b0: float
    b1: float
    b0_ci95: tuple[float, float]
    b1_ci95: tuple[float, float]
    r2: float
    rmse: float
    n: int
    n_effective: float


class Calibration(Result):
    """A finished calibration: the baseline and what it was learnt from."""

    _inner: _drift.Calibration

    def __init__(self, inner: _drift.Calibration) -> None:
        self._inner = inner

    @property
    def baseline(self) -> Baseline:
        """What a monitor runs on."""
        return Baseline._of(self._inner.baseline)

    @property
    def answer(self) -> Answer:
        """What it comes to."""
        return Answer._of(json.loads(self._inner.answer_json()))

    @property
    def channels(self) -> list[ChannelLine]:
        """The judged channels."""
        return [_channel_line(fields) for fields in self.to_dict()["channels"]]

    @property
    def warnings(self) -> list[str]:
        """What a user should know."""
        return self._inner.warnings

    @property
    def window_s(self) -> float:
        """Length of a window, s."""
        return self.baseline.window_s

    def to_dict(self) -> dict[str, Any]:
        """The document that ``drift calibrate --json`` writes."""
        return dict(json.loads(self._inner.to_json()))


def _channel_line(fields: dict[str, Any]) -> ChannelLine:
    names = ("kind", "b0", "b1", "r2", "rmse", "n", "n_effective")
    numbers = {name: fields[name] for name in names}
    return ChannelLine(b0_ci95=tuple(fields["b0_ci95"]), b1_ci95=tuple(fields["b1_ci95"]), **numbers)


def calibrate(
    healthy: Data | Sequence[Data],
    *,
    window_s: float | None = None,
    hop_s: float | None = None,
    index: Literal["iae", "ise", "itae", "itse"] = "iae",
    false_alarm_every_h: float = 24.0,
    confidence: float = 0.9,
    channels: Sequence[str] = ("energy_error", "effort", "activity"),
    effort: Literal["holding", "motion"] = "holding",
    effort_memory: int | None = None,
    operating_point: Sequence[str] = (),
    detectors: Sequence[str] = ("shewhart", "cusum"),
    k: float = 0.5,
    lambda_: float = 0.1,
    saturation: tuple[float, float] | None = None,
    blank_step: float | None = None,
    blank_s: float | None = None,
    confirm_hops: int = 20,
    **reading: Unpack[Reading],
) -> Calibration:
    """Learns what healthy looks like: each channel's line, and thresholds for a wanted time between false alarms.

    Parameters
    ----------
    healthy
        One healthy recording of the loop, or a list of them, all of one sample time.
    window_s, hop_s
        Window, and time from one decision to the next, in seconds; by default 20 correlation times of the loop, and the window.
    index
        Error index of the energy_error channel.
    false_alarm_every_h
        Wanted mean time between false alarms of all channels and detectors together, hours.
    confidence
        Share of calibrations that is aimed to keep it, 0.5 to 0.99.
    channels
        What is judged.
    effort
        Effort to hold y, or, for a plant that integrates, along the motion.
    effort_memory
        Windows before this one that the effort takes into account, 0 to 3; chosen by validation where nothing is said.
    operating_point
        Measured columns that the effort depends on besides y, up to three.
    detectors
        What watches each channel: ``shewhart``, ``cusum``, ``ewma``, ``sprt``.
    k
        The CUSUM's reference value: half the shift to be found, in sigmas.
    lambda_
        The EWMA's weight of the newest window.
    saturation
        Limits of u: samples at or beyond them are left out.
    blank_step, blank_s
        A change of r beyond the first is a step, after which samples are left out for so many seconds.
    confirm_hops
        Decisions after an alarm before a drift can be confirmed.
    **reading
        How recordings are read; see `Reading`.

    Raises
    ------
    DriftError
        Recordings of different sample times, too few windows, or nothing in them that varies.

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
    >>> calibration = drift.calibrate(healthy, window_s=1000.0)
    >>> calibration.answer.status
    'learnt'
    >>> calibration.baseline
    <Baseline: windows of 1000 s, a decision every 1000 s>
    """
    if (blank_step is None) != (blank_s is None):
        raise _drift.DriftError("blank_step and blank_s go together; both or none")
    every: Sequence[Data] = healthy if isinstance(healthy, list | tuple) else [healthy]
    recordings = [as_recording(one, reading, further=list(operating_point)) for one in every]
    inner = _drift.calibrate(
        [recording._inner for recording in recordings],
        window_s=window_s,
        hop_s=hop_s,
        index=index,
        false_alarm_every_h=false_alarm_every_h,
        confidence=confidence,
        channels=list(channels),
        effort=effort,
        effort_memory=effort_memory,
        operating_point=list(operating_point),
        detectors=list(detectors),
        k=k,
        lambda_=lambda_,
        saturation=saturation,
        blanking=None if blank_step is None or blank_s is None else (blank_step, blank_s),
        confirm_hops=confirm_hops,
    )
    return Calibration(inner)
