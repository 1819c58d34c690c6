"""Plants as python-control and scipy hold them, both ways."""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ._drift import DriftError

Plant: TypeAlias = dict[str, Any]
"""The table ``[plant]`` of a loop file."""


def from_system(system: Any) -> Plant:
    """A plant of a linear system in continuous time with one input and one output.

    Parameters
    ----------
    system
        ``control.TransferFunction``, ``control.StateSpace``, ``scipy.signal.TransferFunction``, ``ZerosPolesGain`` or
        ``StateSpace``.

    Returns
    -------
    Plant
        The table ``[plant]`` of a loop file: coefficients from the highest power of s down, or matrices.

    Raises
    ------
    DriftError
        The system is in discrete time, or has several inputs or outputs.

    Examples
    --------
    >>> import drift, scipy.signal
    >>> drift.from_system(scipy.signal.TransferFunction([2.0], [3.0, 1.0]))
    {'kind': 'transfer-function', 'num': [0.6666666666666666], 'den': [1.0, 0.3333333333333333]}
    >>> import control
    >>> drift.from_system(control.tf([2.0], [3.0, 1.0]))
    {'kind': 'transfer-function', 'num': [2.0], 'den': [3.0, 1.0]}
    """
    if getattr(system, "dt", None) not in (None, 0):
        raise DriftError(f"the plant is in discrete time (dt = {system.dt}); a system in continuous time")
    if hasattr(system, "A"):
        return _of_matrices(system)
    if not hasattr(system, "num") and hasattr(system, "to_tf"):
        system = system.to_tf()
    if hasattr(system, "num") and hasattr(system, "den"):
        return {"kind": "transfer-function", "num": _coefficients(system.num), "den": _coefficients(system.den)}
    kinds = "control.TransferFunction, control.StateSpace, or one of scipy.signal"
    raise TypeError(f"{type(system).__name__} is no linear system; {kinds}")


def to_control(plant: Mapping[str, Any]) -> Any:
    """A plant as ``control.StateSpace`` (of a servo or a state space) or ``control.TransferFunction``.

    What is not linear stays behind: offsets and dead times (``plant["delay_s"]``; see ``control.pade``).

    Examples
    --------
    >>> import drift
    >>> plant = drift.to_control({"kind": "first-order", "gain": 2.0, "time_constant_s": 4.0, "delay_s": 0.5, "offset": 20.0})
    >>> float(plant.dcgain())
    2.0
    """
    import control

    kind, numbers = _linear(plant)
    return control.tf(*numbers) if kind == "transfer-function" else control.ss(*numbers)


def to_scipy(plant: Mapping[str, Any]) -> Any:
    """A plant as ``scipy.signal.StateSpace`` (of a servo or a state space) or ``scipy.signal.TransferFunction``.

    What is not linear stays behind: offsets and dead times.

    Examples
    --------
    >>> import drift
    >>> drift.to_scipy({"kind": "transfer-function", "num": [1.0], "den": [1.0, 0.5]}).poles
    array([-0.5])
    """
    import scipy.signal

    kind, numbers = _linear(plant)
    return scipy.signal.TransferFunction(*numbers) if kind == "transfer-function" else scipy.signal.StateSpace(*numbers)


def _linear(plant: Mapping[str, Any]) -> tuple[str, tuple[Any, ...]]:
    """The linear dynamics from u to y: numerator and denominator, or four matrices."""
    match plant.get("kind"):
        case "transfer-function":
            return "transfer-function", (plant["num"], plant["den"])
        case "first-order":
            return "transfer-function", ([plant["gain"]], [plant["time_constant_s"], 1.0])
        case "state-space":
            rows = (np.array(plant["a"]), np.reshape(plant["b"], (-1, 1)), np.reshape(plant["c"], (1, -1)))
            return "state-space", (*rows, np.array([plant.get("d", [0.0])]))
        case "servo":
            viscous, inertia = plant.get("viscous", 0.0), plant["inertia"]
            a = np.array([[0.0, 1.0], [0.0, -viscous / inertia]])
            b = np.array([[0.0], [plant.get("actuator_gain", 1.0) / inertia]])
            c = np.array([[1.0, 0.0]] if plant.get("output", "position") == "position" else [[0.0, 1.0]])
            return "state-space", (a, b, c, np.array([[0.0]]))
        case kind:
            allowed = "first-order, transfer-function, state-space, servo"
            raise DriftError(f"a {kind} plant has no linear dynamics of its own; {allowed}")


def _of_matrices(system: Any) -> Plant:
    a, b, c, d = (np.atleast_2d(np.asarray(getattr(system, name), dtype=np.float64)) for name in "ABCD")
    if b.shape[1] != 1 or c.shape[0] != 1:
        raise DriftError(f"the plant has {b.shape[1]} inputs and {c.shape[0]} outputs; one of each")
    return {
        "kind": "state-space",
        "a": a.tolist(),
        "b": b[:, 0].tolist(),
        "c": c[0].tolist(),
        "d": d[0].tolist(),
    }


def _coefficients(polynomials: Any) -> list[float]:
    """One polynomial, which python-control holds in a list of lists."""
    while isinstance(polynomials, list | tuple) or (isinstance(polynomials, np.ndarray) and polynomials.dtype == object):
        outer = list(polynomials)
        if not any(isinstance(item, list | tuple | np.ndarray) for item in outer):
            break
        if len(outer) != 1:
            raise DriftError(f"the plant has {len(outer)} inputs or outputs; one of each")
        polynomials = outer[0]
    array: NDArray[np.float64] = np.asarray(polynomials, dtype=np.float64)
    if array.ndim == 2 and array.shape[0] == 1:
        array = array[0]
    if array.ndim != 1:
        raise DriftError("the plant has several inputs or outputs; one of each")
    leading = int(np.argmax(array != 0.0)) if array.any() else array.size - 1
    return [float(coefficient) for coefficient in array[leading:]]
