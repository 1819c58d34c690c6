"""Loops: what is known of controller, plant and sensor."""

from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Self

from . import _drift, _toml
from ._plant import Plant, from_system


class Loop:
    """A control loop: controller, plant, sensor and a list of physics terms.

    Made by `Loop.from_toml`, `Loop.from_dict` or `Loop.read`; `drift.init` proposes one for a recording. Two loops are equal
    where all their numbers are.
    """

    _inner: _drift.Loop
    _name: str

    def __init__(self) -> None:
        raise TypeError("a Loop is made by Loop.from_toml, Loop.from_dict, Loop.read or drift.init")

    @classmethod
    def _of(cls, inner: _drift.Loop, name: str = "loop") -> Self:
        made = cls.__new__(cls)
        made._inner, made._name = inner, name
        return made

    @classmethod
    def from_toml(cls, text: str, *, name: str = "loop") -> Self:
        """Reads the text of a loop file.

        Parameters
        ----------
        text
            TOML with the tables ``[loop]``, ``[controller]``, ``[plant]`` and, where needed, ``[units]``, ``[sensor]``,
            ``[[inputs]]`` and ``[[physics]]``.
        name
            What errors and reports call it.

        Raises
        ------
        DriftError
            The first fault, with its line and what is allowed.

        Examples
        --------
        >>> import drift
        >>> loop = drift.Loop.from_toml('''
        ... [loop]
        ... sample_time_s = 1.0
        ... [controller]
        ... kind = "pi"
        ... kp = 2.0
        ... ki = 0.1
        ... [plant]
        ... kind = "first-order"
        ... gain = 0.5
        ... time_constant_s = 30.0
        ... ''')
        >>> loop.sample_time_s
        1.0
        >>> drift.Loop.from_toml("[loop]")
        Traceback (most recent call last):
        drift.DriftError: loop:1: [loop] lacks the key 'sample_time_s'; sample_time_s = a finite number > 0
        """
        return cls._of(_drift.Loop.parse(text, name), name)

    @classmethod
    def from_dict(cls, tables: Mapping[str, Any], *, name: str = "loop") -> Self:
        """Takes the tables of a loop file as a dict.

        The plant may be a linear system of python-control or `scipy.signal` instead of a table; see `from_system`.

        Examples
        --------
        >>> import drift, scipy.signal
        >>> loop = drift.Loop.from_dict({
        ...     "loop": {"sample_time_s": 0.1},
        ...     "controller": {"kind": "pi", "kp": 2.0, "ki": 1.0},
        ...     "plant": scipy.signal.TransferFunction([1.0], [2.0, 1.0]),
        ... })
        >>> loop.to_dict()["plant"]["kind"]
        'transfer-function'
        """
        plant = tables.get("plant")
        if plant is not None and not isinstance(plant, Mapping):
            tables = {**tables, "plant": from_system(plant)}
        return cls.from_toml(_toml.text(tables), name=name)

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Self:
        """Reads a loop file."""
        return cls._of(_drift.Loop.read(fspath(path)), fspath(path))

    def with_plant(self, plant: Any) -> Self:
        """The same loop around another plant: a table, or a linear system of python-control or `scipy.signal`."""
        return self.from_dict({**self.to_dict(), "plant": plant})

    def with_physics(self, kind: str, **numbers: Any) -> Self:
        """The same loop with one more physics term, as a table ``[[physics]]`` states it.

        Examples
        --------
        >>> import drift
        >>> healthy = drift.Loop.from_dict({
        ...     "loop": {"sample_time_s": 5.0},
        ...     "controller": {"kind": "pi", "kp": 4.0, "ki": 0.025},
        ...     "plant": {"kind": "first-order", "gain": 0.8, "time_constant_s": 180.0, "offset": 21.0},
        ... })
        >>> faulty = healthy.with_physics("sensor_bias", bias=2.0, onset_s=3600.0)
        >>> faulty.to_dict()["physics"][0]["kind"]
        'sensor_bias'
        """
        tables = self.to_dict()
        term = {"kind": kind, **numbers}
        return self.from_dict({**tables, "physics": [*tables.get("physics", []), term]})

    def to_toml(self) -> str:
        """The text of a loop file that reads back as this loop."""
        return self._inner.to_toml()

    def to_dict(self) -> dict[str, Any]:
        """The tables of the loop file."""
        return _toml.tables(self._inner.to_toml())

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the loop file."""
        Path(path).write_text(self.to_toml(), encoding="utf-8")

    @property
    def sample_time_s(self) -> float:
        """Time between samples, s."""
        return self._inner.sample_time_s

    @property
    def inputs(self) -> list[str]:
        """The columns of the loop's measured inputs."""
        return self._inner.inputs

    @property
    def plant(self) -> Plant:
        """The plant's table."""
        return dict(self.to_dict()["plant"])

    def __eq__(self, other: object) -> bool:
        """Whether all their numbers are equal."""
        return isinstance(other, Loop) and self._inner == other._inner

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        """In one line."""
        tables = self.to_dict()
        terms = [term["kind"] for term in tables.get("physics", [])]
        beside = f", {', '.join(terms)}" if terms else ""
        kinds = f"{tables['controller']['kind']} controller, {tables['plant']['kind']} plant{beside}"
        return f"<Loop {self._name!r}: {kinds}, every {self.sample_time_s:g} s>"


def as_loop(loop: "Loop | str | PathLike[str] | Mapping[str, Any]") -> Loop:
    """A loop of whatever a user holds: a Loop, a path or the tables of a loop file."""
    if isinstance(loop, Loop):
        return loop
    if isinstance(loop, str | PathLike):
        return Loop.read(loop)
    if isinstance(loop, Mapping):
        return Loop.from_dict(loop)
    raise TypeError(f"{type(loop).__name__} is no loop; a Loop, the path of a loop file, or its tables as a dict")
