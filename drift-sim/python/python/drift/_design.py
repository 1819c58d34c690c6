"""Detectors designed on paper: thresholds and run lengths."""

import json
from typing import Any, Literal

from . import _drift


class Design:
    """A designed detector. Run lengths count decisions, one a hop.

    Attributes
    ----------
    detector
        ``cusum``, ``ewma``, ``shewhart`` or ``sprt``.
    h
        The threshold, sigmas (SPRT: log-likelihood ratio).
    arl0
        Mean decisions to a false alarm.
    arl1
        Mean decisions to the alarm after the mean has moved by `shift` sigmas.
    """

    def __init__(self, inner: _drift.Design) -> None:
        self._fields: dict[str, Any] = json.loads(inner.to_json())
        self.detector: str = self._fields["detector"]
        self.h: float = self._fields["h"]
        self.shift: float = self._fields["shift"]
        self.arl0: float = self._fields["arl0"]
        self.arl1: float = self._fields["arl1"]

    def to_dict(self) -> dict[str, Any]:
        """The document that ``drift design --json`` writes."""
        return self._fields

    def __repr__(self) -> str:
        """In one line."""
        found = f"arl0 = {self.arl0:.6g}, arl1 = {self.arl1:.6g} at a shift of {self.shift:g} sigma"
        return f"<Design {self.detector}: h = {self.h:.6g}, {found}>"


def design(
    detector: Literal["cusum", "ewma", "shewhart", "sprt"] = "cusum",
    *,
    k: float | None = None,
    lambda_: float | None = None,
    h: float | None = None,
    arl0: float | None = None,
    shift: float | None = None,
    head_start: float | None = None,
    slope: float | None = None,
    one_sided: bool = False,
    windows: float | None = None,
    confidence: float | None = None,
    mission: int | None = None,
    hop_s: float | None = None,
    ratio: float | None = None,
    beta: float | None = None,
) -> Design:
    """Designs a detector: its threshold from the wanted time between false alarms, or that time from the threshold.

    All on a standardised residual, one a decision, independent and normal in health.

    Parameters
    ----------
    detector
        Which one.
    k
        Allowance in sigmas (0 to 10): half the shift to be found. The SPRT looks for a shift of 2k; Shewhart and EWMA have none.
    lambda_
        EWMA: weight of the newest residual (0.01 to 1); 0.1 where nothing is said.
    h, arl0
        Threshold, or wanted mean number of decisions to a false alarm: one of them.
    shift
        The shift of the mean in sigmas that arl1 is for; 2k where nothing is said, 1 for Shewhart and EWMA.
    head_start
        CUSUM: start at this fraction of h.
    slope
        Also the run length under a drift of this many sigmas a decision.
    one_sided
        Watch for a rise only.
    windows, confidence
        CUSUM: mean and sigma come from so many independent windows; the threshold then keeps `arl0` in this share of all
        commissionings (0.9 where nothing is said).
    mission
        Also the probability of an alarm within so many decisions.
    hop_s
        Seconds from one decision to the next: run lengths in hours too.
    ratio, beta
        SPRT: also look for a deviation so many times the healthy one; probability to miss.

    Examples
    --------
    >>> import drift
    >>> drift.design(k=0.5, h=5.0, shift=1.0)
    <Design cusum: h = 5, arl0 = 465.444, arl1 = 10.376 at a shift of 1 sigma>
    >>> round(drift.design(k=0.5, arl0=2000.0).h, 3)
    6.447
    """
    inner = _drift.design(
        detector,
        k=k,
        lambda_=lambda_,
        h=h,
        arl0=arl0,
        shift=shift,
        head_start=head_start,
        slope=slope,
        one_sided=one_sided,
        windows=windows,
        confidence=confidence,
        mission=mission,
        hop_s=hop_s,
        ratio=ratio,
        beta=beta,
    )
    return Design(inner)
