"""Writes recordings: one line of names, `t,r,y,u` first, an empty field where nothing is known."""
import csv
import os

import numpy as np


def text(value):
    if value is None or not np.isfinite(value):
        return ""
    return f"{value:.8g}"


def write(path, **columns):
    """Columns in the order given, all of one length; None is a column of empty fields."""
    count = max(len(column) for column in columns.values() if column is not None)
    filled = {name: [None] * count if column is None else np.asarray(column, float) for name, column in columns.items()}
    wrong = [name for name, column in filled.items() if len(column) != count]
    if wrong:
        raise SystemExit(f"{path}: column '{wrong[0]}' has {len(filled[wrong[0]])} rows; the others have {count}")
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(filled)
        out.writerows([text(value) for value in row] for row in zip(*filled.values()))
    print(f"{path}: {count} rows")
