"""Runs of a loop."""

from collections.abc import Mapping
from os import PathLike
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _drift, _figure
from ._loop import Loop, as_loop
from ._recording import Data, Reading, Recording, as_recording


class Simulation:
    """A run of a loop: one value a sample, in arrays of its own.

    Attributes
    ----------
    t
        Time of each sample, s.
    r, y, u
        Reference, what the sensor shows, and the controller's output.
    true_y
        y as it is, which no recording holds.
    inputs
        The loop's measured inputs by column.
    loop
        The loop that ran.
    """

    t: NDArray[np.float64]
    r: NDArray[np.float64]
    y: NDArray[np.float64]
    u: NDArray[np.float64]
    true_y: NDArray[np.float64]
    inputs: dict[str, NDArray[np.float64]]
    loop: Loop

    def __init__(self, inner: _drift.Simulation, loop: Loop) -> None:
        self.t, self.r, self.y, self.u, self.true_y = inner.t, inner.r, inner.y, inner.u, inner.true_y
        self.inputs = dict(zip(loop.inputs, inner.inputs, strict=True))
        self.loop = loop

    def to_recording(self, name: str = "simulation") -> Recording:
        """What a logger would have recorded of the run."""
        return Recording(self.t, self.r, self.y, self.u, further=self.inputs, name=name)

    def to_dict(self) -> dict[str, NDArray[np.float64]]:
        """The columns that the command writes: t, r, y, u and the inputs."""
        return {"t": self.t, "r": self.r, "y": self.y, "u": self.u, **self.inputs}

    def plot(self) -> Any:
        """Draws r and y over u; a matplotlib figure."""
        return _figure.signals("simulated", self.t, [("r", self.r), ("y", self.y)], [("u", self.u)])

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.t)

    def __repr__(self) -> str:
        """In one line."""
        return f"<Simulation: {len(self)} samples every {self.loop.sample_time_s:g} s>"


def simulate(
    loop: Loop | str | PathLike[str] | Mapping[str, Any],
    reference: Data | ArrayLike | None = None,
    *,
    duration_s: float | None = None,
    seed: int = 0,
    inputs: Mapping[str, ArrayLike] | None = None,
    reference_mean: float = 0.1,
    reference_sd: float = 1.0,
    reference_hold: int = 50,
    **reading: Unpack[Reading],
) -> Simulation:
    """Runs a loop.

    Parameters
    ----------
    loop
        A Loop, the path of a loop file, or its tables.
    reference
        What the loop is asked to follow: an array of one value a sample, from rest; or a recording, from its first y and u, whose
        inputs (and, for a recorded controller, u) are taken too. Without it, random levels.
    duration_s
        Length of the run in seconds; by default 10 000 samples, or all of the reference.
    seed
        All noise, and a random reference, follow from this number.
    inputs
        The loop's measured inputs by column, beside an array of the reference.
    reference_mean, reference_sd
        Mean and standard deviation of random levels, in the unit of r.
    reference_hold
        How long each level is held, in samples.
    **reading
        How the recording is read; see `Reading`.

    Returns
    -------
    Simulation
        The run. The same loop, seed and input give the same bits on every machine.

    Examples
    --------
    >>> import drift, numpy as np
    >>> loop = drift.Loop.from_dict({
    ...     "loop": {"sample_time_s": 1.0},
    ...     "controller": {"kind": "pi", "kp": 4.0, "ki": 0.2},
    ...     "plant": {"kind": "first-order", "gain": 0.5, "time_constant_s": 30.0},
    ... })
    >>> run = drift.simulate(loop, np.full(300, 10.0))
    >>> bool(abs(run.y[-1] - 10.0) < 0.01)
    True
    """
    model = as_loop(loop)
    levels = (reference_mean, reference_sd, reference_hold)
    recording: Recording | None = None
    given: NDArray[np.float64] | None = None
    columns: list[NDArray[np.float64]] = []
    if _is_array(reference):
        given = np.ascontiguousarray(reference, dtype=np.float64)
        named = dict(inputs or {})
        if missing := [name for name in model.inputs if name not in named]:
            raise _drift.DriftError(f"the loop's input {missing[0]!r} is not given; inputs={{{missing[0]!r}: ...}}")
        columns = [np.ascontiguousarray(named[name], dtype=np.float64) for name in model.inputs]
    elif reference is not None:
        recording = as_recording(reference, reading, further=model.inputs)
    inner = _drift.simulate(
        model._inner,
        recording=recording._inner if recording is not None else None,
        reference=given,
        inputs=columns,
        duration_s=duration_s,
        seed=seed,
        levels=levels,
    )
    return Simulation(inner, model)


def _is_array(reference: object) -> bool:
    """Numbers, and no table or path."""
    if isinstance(reference, np.ndarray):
        return reference.dtype.names is None
    return isinstance(reference, list | tuple) or (hasattr(reference, "to_numpy") and not hasattr(reference, "columns"))
