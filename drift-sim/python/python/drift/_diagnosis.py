"""Diagnoses: the physics that a model left out of a recording."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import Any, Unpack

from . import _drift
from ._loop import Loop, as_loop
from ._recording import Data, Reading, as_recording
from ._result import Answer, Result


@dataclass(frozen=True)
class Number:
    """A fitted number.

    Attributes
    ----------
    name
        Its name in the loop file.
    value
        As fitted.
    unit
        Its unit; empty where none is known.
    ci95
        Its 95 % interval; None where it is not determined, or held.
    nominal
        As the loop file states it; None of physics, which the loop file lacks.
    """

    name: str
    value: float
    unit: str
    ci95: tuple[float, float] | None
    nominal: float | None = None


@dataclass(frozen=True)
class Finding:
    """Physics that was found missing.

    Attributes
    ----------
    kind
        Its kind, as a loop file calls it.
    place
        Where in the loop it acts.
    onset_s
        When it began, s from the recording's first sample; 0 from the start.
    parameters
        Its numbers.
    says
        What it means, in a sentence.
    indistinguishable_from
        Kinds that these recordings can't tell from it.
    experiment
        What would tell them apart.
    may_be_nothing
        Whether its interval holds nothing at all.
    evidence
        What speaks for it.
    """

    kind: str
    place: str
    onset_s: float
    parameters: list[Number]
    says: str
    indistinguishable_from: list[str]
    experiment: str
    may_be_nothing: bool
    evidence: dict[str, Any]


class Diagnosis(Result):
    """What a diagnosis found."""

    _inner: _drift.Diagnosis

    def __init__(self, inner: _drift.Diagnosis) -> None:
        self._inner = inner

    @cached_property
    def _fields(self) -> dict[str, Any]:
        return dict(json.loads(self._inner.to_json()))

    @property
    def verdict(self) -> str:
        """``no_mismatch``, ``parameters``, ``missing_physics``, ``located`` or ``undecided``."""
        return str(self._fields["verdict"])

    @property
    def place(self) -> str | None:
        """Where in the loop."""
        place = self._fields["place"]
        return None if place is None else str(place)

    @property
    def answer(self) -> Answer:
        """What it comes to."""
        return Answer._of(self._fields["answer"])

    @property
    def physics(self) -> list[Finding]:
        """The physics that was named, the strongest first."""
        return [_finding(fields) for fields in self._fields["physics"]]

    @property
    def candidates(self) -> dict[str, float]:
        """Kinds that are left where none can be named, with what each gains in nats."""
        return {row["kind"]: row["gain"] for row in self._fields["candidates"]}

    @property
    def parameters(self) -> list[Number]:
        """The loop's own numbers, as stated and refitted."""
        return [_number(fields) for fields in self._fields["parameters"]]

    @property
    def untestable(self) -> dict[str, str]:
        """Kinds that this recording can't show, with the reason."""
        return {row["kind"]: row["why"] for row in self._fields["untestable"]}

    @property
    def nominal(self) -> Loop:
        """The loop that was diagnosed, its plant identified where that was left open."""
        return Loop._of(self._inner.loops[0], "nominal")

    @property
    def refitted(self) -> Loop:
        """The same with its own numbers refitted."""
        return Loop._of(self._inner.loops[1], "refitted")

    @property
    def improved(self) -> Loop:
        """The loop with what was found."""
        return Loop._of(self._inner.loops[2], "improved")

    def to_dict(self) -> dict[str, Any]:
        """The document that ``drift diagnose --json`` writes."""
        return self._fields


def _number(fields: dict[str, Any]) -> Number:
    interval = fields["ci95"]
    ci95 = None if interval is None else (interval[0], interval[1])
    return Number(fields["name"], fields["value"], fields.get("unit", ""), ci95, fields.get("nominal"))


def _finding(fields: dict[str, Any]) -> Finding:
    names = ("kind", "place", "onset_s", "says", "indistinguishable_from", "experiment", "may_be_nothing", "evidence")
    parameters = [_number(parameter) for parameter in fields["parameters"]]
    return Finding(parameters=parameters, **{name: fields[name] for name in names})


def diagnose(
    data: Data | Sequence[Data],
    loop: Loop | str | PathLike[str] | Mapping[str, Any] | None = None,
    *,
    holdout: Data | None = None,
    healthy: Data | Sequence[Data] = (),
    guarantee: float | None = None,
    **reading: Unpack[Reading],
) -> Diagnosis:
    """Finds, names, models and proves the physics that a simulation left out of a recorded loop.

    It takes seconds to minutes. Ctrl-C ends it.

    Parameters
    ----------
    data
        The recording, or a list of recordings of one loop in which the same is wrong: they are pooled, the first is shown.
    loop
        What is known of the loop: a Loop, the path of a loop file, or its tables. Without it the law is looked for in the first
        healthy recording, or in the recording itself where there is no healthy one, and the plant is identified.
    holdout
        Another recording, for the proof; without it the last 30 % of each are held out.
    healthy
        One recording from before, or a list of them: what has changed since? The nominal numbers (or the identified plant) come from them.
    guarantee
        The probability with which the true cause may be lost (0.05, say): a cause is named only if all others are excluded. Slower.
    **reading
        How recordings are read; see `Reading`.

    Raises
    ------
    DriftError
        The recording is too short, does not move, or is not of this loop.

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
    >>> run = drift.simulate(loop, duration_s=10_000, **levels)
    >>> drift.diagnose(run.to_recording(), loop).verdict
    'no_mismatch'
    """
    def several(of: Data | Sequence[Data]) -> list[Data]:
        return list(of) if isinstance(of, list | tuple) else [of]

    model = None if loop is None else as_loop(loop)
    further = () if model is None else model.inputs
    recordings = [as_recording(one, reading, further=further) for one in several(data)]
    read = [as_recording(one, reading, further=further) for one in several(healthy)]
    unseen = None if holdout is None else as_recording(holdout, reading, further=further)
    inner = _drift.diagnose(
        [one._inner for one in recordings],
        None if model is None else (model._name, model._inner),
        holdout=None if unseen is None else unseen._inner,
        healthy=[one._inner for one in read],
        guarantee=guarantee,
    )
    return Diagnosis(inner)
