"""What every result has: an answer for people, its numbers as a dict, a page."""

import json
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Protocol

from . import _figure


@dataclass(frozen=True)
class KeyNumber:
    """A number that a reader takes away, and what it is."""

    value: str
    label: str


@dataclass(frozen=True)
class Answer:
    """What a result comes to, the same as on a page.

    Attributes
    ----------
    status
        ``healthy``, ``suspect``, ``drift``, ``cause_found`` or ``cant_tell``; None of what is not about one loop.
    sentence
        One plain sentence.
    also
        What else there is to say; may be empty.
    numbers
        Three at most.
    """

    status: str | None
    sentence: str
    also: str
    numbers: list[KeyNumber]

    @classmethod
    def _of(cls, fields: dict[str, Any]) -> "Answer":
        numbers = [KeyNumber(number["value"], number["label"]) for number in fields["numbers"]]
        return cls(fields["status"], fields["sentence"], fields["also"], numbers)


class Paged(Protocol):
    """What the extension's results have in common."""

    def answer(self) -> str: ...
    def html(self) -> str: ...
    def first_screen(self) -> str: ...
    def figure(self) -> str | None: ...


class Result:
    """A result with an answer for people, a page and a picture."""

    _inner: Paged

    def to_html(self) -> str:
        """The page that the command writes with ``--report``: one HTML file that needs nothing else."""
        return self._inner.html()

    def save_html(self, path: str | PathLike[str]) -> None:
        """Writes the page."""
        Path(path).write_text(self.to_html(), encoding="utf-8")

    def plot(self) -> Any:
        """Draws the picture that proves the answer; a matplotlib figure, or None where there is nothing to draw."""
        figure = self._inner.figure()
        return None if figure is None else _figure.draw(json.loads(figure))

    def __repr__(self) -> str:
        """The answer in words."""
        return f"<{type(self).__name__}>\n{self._inner.answer().strip()}"

    def _repr_html_(self) -> str:
        return self._inner.first_screen()
