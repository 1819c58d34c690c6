"""Loop files as tables and back: numbers, text, switches, lists and tables are all that they hold."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def tables(text: str) -> dict[str, Any]:
    """The tables of a loop file's text."""
    return tomllib.loads(text)


def text(of: Mapping[str, Any]) -> str:
    """The tables as TOML, all of them inline: one line for each key of the top."""
    return "".join(f"{_key(key)} = {_value(value, str(key))}\n" for key, value in of.items() if value is not None)


def _key(key: Any) -> str:
    return json.dumps(str(key))


def _value(value: Any, at: str) -> str:
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        held = (f"{_key(key)} = {_value(item, f'{at}.{key}')}" for key, item in value.items() if item is not None)
        return "{" + ", ".join(held) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(_value(item, at) for item in value) + "]"
    raise TypeError(f"{at} is a {type(value).__name__}; a number, a text, True, False, a list or a dict of them")
