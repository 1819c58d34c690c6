"""Recordings: r, y and u of a loop at uniform times."""

from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from typing import Any, Self, TypeAlias, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _drift, _figure
from ._table import Named, column, is_table, named_columns


class Reading(TypedDict, total=False):
    """How a recording is read; every function that reads one takes these keywords.

    Attributes
    ----------
    columns
        Columns of the signals where they are not called t, r, y, u, nor SP, PV, OP and the like, which are guessed:
        ``"t=time,r=SP"`` or ``{"t": "time", "r": "SP"}``. ``{"t": None}`` ignores the time stamps, ``{"r": None}`` says that r
        is not recorded.
    sample_time_s
        Sample time in seconds where there are no time stamps.
    resample_s
        Put unequally sampled rows on a grid of this step in seconds: y interpolated, r and u held.
    when
        Where the loop is closed, like ``"mode=AUTO"``, or several such conditions; elsewhere samples count as manual.
    repeated
        Rows that repeat a time stamp with other values: ``"refuse"``, ``"first"``, ``"last"`` or ``"mean"``.
    dates
        How dates like 5/1/2024 are meant: ``"day-first"`` or ``"month-first"``.
    time_in
        What numbers in the time column count where its name states no unit: ``"seconds"``, or ``"days"`` as spreadsheets do.
    part
        Which part is read of a log in which time begins anew, as after a restart: 1, 2, ... or ``"last"``.
    memory_limit_bytes
        What reading one recording may take; 2 GiB where nothing is said.
    """

    columns: str | Mapping[str, str | None] | None
    sample_time_s: float | None
    resample_s: float | None
    when: str | Sequence[str] | None
    repeated: str | None
    dates: str | None
    time_in: str | None
    part: int | str | None
    memory_limit_bytes: int | None


class Recording:
    """r, y and u of a loop at uniform times.

    Time stamps are checked as those of files are: they may be rounded and may jump over missing samples, but they may not go
    back or be uneven (``resample_s`` puts such rows on a grid).

    Parameters
    ----------
    t
        Times in seconds, or dates; None where `sample_time_s` says how often samples were taken.
    r, y, u
        Reference, measured output and controller output. NaN is missing. r may be None: the controller is then taken to hold
        one value.
    closed
        Whether the loop was closed at each sample; elsewhere samples count as manual.
    further
        Further columns by name: measured inputs of the loop, or its operating point.
    name
        What errors and reports call it.
    **reading
        See `Reading`.

    Examples
    --------
    >>> import numpy as np, drift
    >>> t = np.arange(200) * 0.1
    >>> r = np.where(t < 10, 1.0, 2.0)
    >>> recording = drift.Recording(t, r, y=0.9 * r, u=3.0 * r)
    >>> recording
    <Recording 'recording': 200 samples every 0.1 s from t = 0 s>
    >>> recording.y[-1]
    np.float64(1.8)
    """

    _inner: _drift.Recording

    def __init__(
        self,
        t: ArrayLike | None,
        r: ArrayLike | None,
        y: ArrayLike,
        u: ArrayLike,
        *,
        closed: ArrayLike | None = None,
        further: Mapping[str, ArrayLike] | None = None,
        name: str = "recording",
        **reading: Unpack[Reading],
    ) -> None:
        given = {"t": t, "r": r, "y": y, "u": u}
        named: Named = [(signal, column(values)) for signal, values in given.items() if values is not None]
        named += [(signal, column(values)) for signal, values in (further or {}).items()]
        if closed is not None:
            named.append(("closed", np.asarray(closed).astype(np.float64)))
            reading.setdefault("when", "closed=1")
        columns = {signal: signal if values is not None else None for signal, values in given.items()}
        reading.setdefault("columns", {signal: columns[signal] for signal in ("t", "r", "y", "u")})
        self._inner = _drift.Recording.from_columns(name, named, [], True, reading)

    @classmethod
    def _of(cls, inner: _drift.Recording) -> Self:
        made = cls.__new__(cls)
        made._inner = inner
        return made

    @classmethod
    def read(
        cls, path: str | PathLike[str], *, further: Sequence[str] | None = None, **reading: Unpack[Reading]
    ) -> Self:
        """Reads a file: CSV, JSON lines, MATLAB, Parquet, ULog and more, told apart by how they begin.

        Parameters
        ----------
        path
            The file.
        further
            Columns to read besides the signals; all that hold numbers where nothing is said.
        **reading
            See `Reading`.

        Raises
        ------
        DriftError
            The file can't be read, lacks a column, holds text where numbers belong or is not uniformly sampled.
        """
        return cls._of(_drift.Recording.read(fspath(path), list(further or []), further is None, reading))

    @classmethod
    def from_table(
        cls,
        table: Any,
        *,
        further: Sequence[str] | None = None,
        name: str = "table",
        **reading: Unpack[Reading],
    ) -> Self:
        """Takes a table: pandas, polars, pyarrow, anything with the Arrow PyCapsule interface, or a mapping of columns.

        Columns are found by name as those of files are, or named by ``columns``. Numbers are only copied into the recording,
        never converted on the way.

        Examples
        --------
        >>> import drift
        >>> table = {"time": [0.0, 0.5, 1.0], "SP": [1, 1, 1], "PV": [0.2, 0.6, 0.8], "OP": [9.0, 5.0, 3.0]}
        >>> recording = drift.Recording.from_table(table)
        >>> recording.columns
        {'t': 'time', 'r': 'SP', 'y': 'PV', 'u': 'OP'}
        """
        named = named_columns(table)
        return cls._of(_drift.Recording.from_columns(name, named, list(further or []), further is None, reading))

    @property
    def name(self) -> str:
        """What errors and reports call it."""
        return self._inner.name

    @property
    def t(self) -> NDArray[np.float64]:
        """Time of each sample, s."""
        return self._inner.t

    @property
    def r(self) -> NDArray[np.float64]:
        """Reference; a view that can't be written to, as all columns."""
        return self._inner.column("r")

    @property
    def y(self) -> NDArray[np.float64]:
        """Measured output; NaN where it is missing."""
        return self._inner.column("y")

    @property
    def u(self) -> NDArray[np.float64]:
        """Controller output; NaN where it is missing."""
        return self._inner.column("u")

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """A signal or further column by name."""
        return self._inner.column(name)

    @property
    def further(self) -> list[str]:
        """The names of the further columns."""
        return self._inner.further

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Whether each sample counts: nothing of it is missing, and the loop is closed."""
        return np.equal(self._inner.state, 0)

    @property
    def manual(self) -> NDArray[np.bool_]:
        """Whether the loop is in manual at each sample."""
        return np.equal(self._inner.state, 2)

    @property
    def sample_time_s(self) -> float:
        """From one sample to the next, s."""
        return self._inner.sample_time_s

    @property
    def start_s(self) -> float:
        """Time of the first sample, s."""
        return self._inner.start_s

    @property
    def zero_s(self) -> float | None:
        """The date at t = 0 as it was written, in seconds since 1970; None where there are no dates."""
        return self._inner.zero_s

    @property
    def columns(self) -> dict[str, str | None]:
        """The columns that the signals came from."""
        return dict(zip(("t", "r", "y", "u"), self._inner.columns, strict=True))

    @property
    def notes(self) -> list[str]:
        """What was guessed or mended on the way, a line each."""
        return self._inner.notes

    @property
    def quality(self) -> str:
        """What was found while reading, in one line."""
        return self._inner.quality

    def to_dict(self) -> dict[str, NDArray[np.float64]]:
        """t, r, y, u and the further columns as arrays; ``pandas.DataFrame(recording.to_dict())`` is a frame of them."""
        names = ["r", "y", "u", *self._inner.further]
        return {"t": self.t, **{name: self._inner.column(name) for name in names}}

    def plot(self) -> Any:
        """Draws r and y over u; a matplotlib figure."""
        return _figure.signals(self.name, self.t, [("r", self.r), ("y", self.y)], [("u", self.u)])

    def __len__(self) -> int:
        """Number of samples, valid or not."""
        return len(self._inner)

    def __repr__(self) -> str:
        """In one line."""
        every = f"{len(self)} samples every {self.sample_time_s:g} s from t = {self.start_s:g} s"
        return f"<Recording {self.name!r}: {every}>"


Data: TypeAlias = Recording | str | PathLike[str] | Mapping[str, ArrayLike] | Any
"""Whatever a user holds."""


def as_recording(data: Data, reading: Reading, further: Sequence[str] | None = None, name: str = "table") -> Recording:
    """A recording of whatever a user holds, with these further columns."""
    if hasattr(data, "to_recording"):
        # A simulated run.
        data = data.to_recording()
    if isinstance(data, Recording):
        if reading:
            raise TypeError(f"{', '.join(reading)}: a Recording has been read already")
        return data
    if isinstance(data, str | PathLike):
        return Recording.read(data, further=further, **reading)
    if is_table(data):
        return Recording.from_table(data, further=further, name=name, **reading)
    kinds = "a Recording, a Simulation, a path, a pandas, polars or pyarrow table, or a mapping of columns"
    raise TypeError(f"{type(data).__name__} is no recording; {kinds}")
