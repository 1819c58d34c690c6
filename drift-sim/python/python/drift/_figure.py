"""Figures of the library drawn by matplotlib."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Line: TypeAlias = tuple[str, NDArray[np.float64]]

# Okabe and Ito (2008): apart for colour-blind readers and in print.
COLOURS = {
    "black": "#000000",
    "grey": "#6e6e6e",
    "blue": "#0072b2",
    "vermilion": "#d55e00",
    "green": "#009e73",
    "orange": "#e69f00",
    "sky": "#56b4e9",
    "purple": "#cc79a7",
    "yellow": "#f0e442",
}
PANEL_INCHES = (7.5, 2.2)


def draw(figure: dict[str, Any]) -> Any:
    """A figure of the library, given as its data; hands back a matplotlib figure."""
    panels, columns = figure["panels"], max(1, figure["columns"])
    rows = -(-len(panels) // columns)
    canvas, axes = _subplots(rows, columns, sharex=figure["shared_x"])
    for panel, axis in zip(panels, axes, strict=False):
        _panel(axis, panel, figure["grids"])
    for axis in axes[len(panels) :]:
        axis.set_visible(False)
    return canvas


def signals(title: str, t: NDArray[np.float64], *panels: Sequence[Line]) -> Any:
    """Signals over time, a panel for each group of them."""
    canvas, axes = _subplots(len(panels), 1, sharex=True)
    for axis, lines in zip(axes, panels, strict=True):
        for (name, values), colour in zip(lines, ("grey", "blue", "vermilion"), strict=False):
            axis.plot(t, values, label=name, color=COLOURS[colour if len(lines) > 1 else "blue"], linewidth=1)
        axis.set_ylabel(", ".join(name for name, _ in lines))
        if len(lines) > 1:
            axis.legend(loc="best", fontsize="small", frameon=False)
    axes[0].set_title(title)
    axes[-1].set_xlabel("t, s")
    return canvas


def _subplots(rows: int, columns: int, *, sharex: bool) -> tuple[Any, list[Any]]:
    try:
        import matplotlib.figure
        import matplotlib.pyplot as plt
    except ModuleNotFoundError as missing:
        raise ModuleNotFoundError("plots are drawn by matplotlib: pip install matplotlib", name=missing.name) from None
    size = (PANEL_INCHES[0], PANEL_INCHES[1] * rows + 0.6)
    canvas, axes = plt.subplots(rows, columns, sharex=sharex, squeeze=False, figsize=size, layout="constrained")
    return canvas, list(axes.flat)


def _panel(axis: Any, panel: dict[str, Any], grids: list[Any]) -> None:
    for layer in panel["layers"]:
        _layer(axis, layer, grids)
    axis.set(title=panel["title"], xlabel=panel["x_label"], ylabel=panel["y_label"])
    for is_log, scale in ((panel["x_log"], axis.set_xscale), (panel["y_log"], axis.set_yscale)):
        if is_log:
            scale("log")
    for wanted, limit in ((panel["x_range"], axis.set_xlim), (panel["y_range"], axis.set_ylim)):
        if wanted is not None:
            limit(wanted)
    for names, ticks in ((panel["x_names"], axis.set_xticks), (panel["y_names"], axis.set_yticks)):
        if names:
            ticks([at for at, _ in names], [name for _, name in names])
    if panel["x_dates"]:
        axis.xaxis.set_major_formatter(_date)
        axis.tick_params(axis="x", labelrotation=20)
    if axis.get_legend_handles_labels()[1]:
        axis.legend(loc="best", fontsize="small", frameon=False)


def _layer(axis: Any, layer: dict[str, Any], grids: list[Any]) -> None:
    colour, name = COLOURS[layer["colour"]], layer["name"] or None
    dashed = "--" if layer.get("dashed") else "-"
    match layer["type"]:
        case "line":
            axis.plot(_x(grids[layer["grid"]]), _y(layer["y"]), dashed, color=colour, label=name, linewidth=1)
        case "band":
            edges = (_y(layer["lower"]), _y(layer["upper"]))
            axis.fill_between(_x(grids[layer["grid"]]), *edges, color=colour, alpha=0.25, label=name, linewidth=0)
        case "points":
            marker = "." if layer["marker"] == "dot" else "x"
            axis.plot(layer["x"], layer["y"], marker, color=colour, label=name, markersize=4)
        case "bars":
            axis.bar(layer["x"], layer["y"], width=layer["width"], color=colour, label=name)
        case "horizontal":
            axis.axhline(layer["y"], color=colour, linestyle=dashed, label=name, linewidth=1)
        case "vertical":
            axis.axvline(layer["x"], color=colour, linestyle=dashed, label=name, linewidth=1)
        case _:
            axis.axvspan(layer["from"], layer["to"], color=colour, alpha=0.2, label=name, linewidth=0)


def _x(grid: Any) -> NDArray[np.float64]:
    if isinstance(grid, dict):
        return np.asarray(grid["start"] + grid["step"] * np.arange(grid["count"]))
    return np.asarray(grid, dtype=np.float64)


def _y(values: list[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _date(seconds: float, _: int | None = None) -> str:
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M")
