"""Tables of other libraries as named columns: arrays of numbers, or lists of text."""

from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Column: TypeAlias = NDArray[np.float64] | NDArray[np.float32] | list[str | None]
Named: TypeAlias = list[tuple[str, Column]]


def is_table(data: object) -> bool:
    """Whether `named_columns` can read it."""
    return isinstance(data, Mapping) or hasattr(data, "__arrow_c_stream__") or _has_named_columns(data) or _is_structured(data)


def named_columns(table: Any) -> Named:
    """The columns of a table by name, numbers without a copy where their layout allows it.

    pandas and polars frames hand over their own columns; anything else that speaks the Arrow PyCapsule interface goes by
    pyarrow. A pandas index that is more than a count of rows is a column as well, called ``t`` where it has no name.
    """
    return [(str(name), column(values)) for name, values in _columns(table)]


def column(values: Any) -> Column:
    """One column: float64 and float32 as they are, other numbers as float64, times and text as text."""
    array = _numpy(values)
    if array.ndim != 1:
        raise ValueError(f"a column of {array.ndim} dimensions; one is needed")
    if array.dtype in (np.float64, np.float32):
        return array
    if array.dtype.kind in "biuf":
        return array.astype(np.float64)
    if array.dtype.kind == "M":
        return _dates(array, zone="Z" if _is_zoned(values) else "")
    if array.dtype.kind == "m":
        return array.astype("timedelta64[ns]").astype(np.float64) * 1e-9
    return _objects(array)


def _columns(table: Any) -> Iterator[tuple[Any, Any]]:
    if isinstance(table, Mapping):
        yield from table.items()
    elif _is_structured(table):
        yield from ((name, table[name]) for name in table.dtype.names)
    elif _has_named_columns(table):
        index = getattr(table, "index", None)
        if index is not None and not (type(index).__name__ == "RangeIndex" and index.name is None):
            yield (index.name if index.name is not None else "t"), index.to_series()
        yield from ((name, table[name]) for name in table.columns)
    else:
        import pyarrow

        read = pyarrow.table(table)
        yield from zip(read.column_names, read.columns, strict=True)


def _has_named_columns(data: Any) -> bool:
    """A frame: its columns are names, each of which gives a series. (The columns of pyarrow's tables are the data.)"""
    names = getattr(data, "columns", None)
    return names is not None and hasattr(data, "__getitem__") and not hasattr(data, "column_names")


def _is_structured(data: object) -> bool:
    return isinstance(data, np.ndarray) and data.dtype.names is not None


def _numpy(values: Any) -> NDArray[Any]:
    dtype = getattr(values, "dtype", None)
    # pandas' nullable numbers: pd.NA is no number to numpy.
    if dtype is not None and not isinstance(dtype, np.dtype) and getattr(dtype, "_is_numeric", False):
        return np.asarray(values.to_numpy(dtype=np.float64, na_value=np.nan))
    if _is_zoned(values) and hasattr(values, "dt") and hasattr(values.dt, "tz_convert"):
        values = values.dt.tz_convert("UTC").dt.tz_localize(None)
    if hasattr(values, "to_numpy"):
        return np.asarray(values.to_numpy())
    return np.asarray(values)


def _is_zoned(values: Any) -> bool:
    dtype = getattr(values, "dtype", getattr(values, "type", None))
    return any(getattr(dtype, name, None) is not None for name in ("tz", "time_zone"))


def _dates(array: NDArray[Any], zone: str) -> list[str | None]:
    """As they would stand in a file, with the digits that all of them need."""
    stamps = array.astype("datetime64[ns]")
    missing = np.isnat(stamps)
    counts = stamps.astype(np.int64)[~missing]
    digits = next((d for d in range(10) if not np.any(counts % 10 ** (9 - d))), 9)
    length = len("2024-05-01T12:00:00") + (digits + 1 if digits else 0)
    texts = np.datetime_as_string(stamps, unit="ns")
    return [None if gone else str(text)[:length] + zone for text, gone in zip(texts, missing, strict=True)]


def _objects(array: NDArray[Any]) -> Column:
    """Text, or numbers among things that are none."""
    values = [None if _is_missing(value) else value for value in array.tolist()]
    if all(value is None or isinstance(value, bool | int | float) for value in values):
        return np.array([np.nan if value is None else float(value) for value in values], dtype=np.float64)
    return [None if value is None else str(value) for value in values]


def _is_missing(value: object) -> bool:
    # pandas' own marks can't be compared.
    return value is None or type(value).__name__ in ("NAType", "NaTType") or value != value
