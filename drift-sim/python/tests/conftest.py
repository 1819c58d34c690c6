"""Loops, runs and the command `drift` that tests share."""

import os
import shutil
import subprocess
from pathlib import Path

import matplotlib
import numpy as np
import pytest

import drift

matplotlib.use("agg")

ROOT = Path(__file__).resolve().parents[3]
LEVELS = {"reference_mean": 35.0, "reference_sd": 3.0, "reference_hold": 200}


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return ROOT


@pytest.fixture(scope="session")
def command() -> Path:
    """The built command: named by DRIFT, or the one in the path."""
    found = os.environ.get("DRIFT") or shutil.which("drift")
    if found is None:
        pytest.skip("the command drift is not there; DRIFT=target/release/drift")
    return Path(found)


@pytest.fixture(scope="session")
def run_command(command):
    """Runs `drift ARGUMENTS` and hands back what it prints; a failure is an error with its line."""

    def run(*arguments, folder=None) -> str:
        done = subprocess.run([command, *map(str, arguments)], capture_output=True, text=True, cwd=folder, check=False)
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip())
        return done.stdout

    return run


@pytest.fixture(scope="session")
def oven() -> drift.Loop:
    """An oven under PI control."""
    return drift.Loop.read(ROOT / "examples/loops/oven.toml")


@pytest.fixture(scope="session")
def healthy(oven) -> drift.Recording:
    """400 000 s of it, healthy."""
    return drift.simulate(oven, duration_s=400_000, **LEVELS).to_recording("healthy")


@pytest.fixture(scope="session")
def calibration(healthy) -> drift.Calibration:
    """Learnt on that."""
    return drift.calibrate(healthy, window_s=1000.0)


@pytest.fixture
def table() -> dict[str, np.ndarray]:
    """A short log by its usual names."""
    t = np.round(np.arange(300) * 0.066, 2)
    return {"time": t, "SP": np.where(t < 8, 1.0, 2.0), "PV": np.sin(t), "OP": np.cos(t)}
