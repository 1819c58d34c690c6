"""What the door costs, side by side with Rust in one run."""

import os
import re
import shutil
import subprocess
import sys
import time

import pandas
import pytest

import drift

pytestmark = pytest.mark.timed

# Rounds of both sides; more of them while the ratio is above the limit: other work only adds to a time, so that the least of each is the nearest.
ROUNDS = 6
MOST_ROUNDS = 18
# What the door may cost: times Rust's side. The array has a decision every 200 samples.
PUSH_AT_MOST = 1.1
DIAGNOSE_AT_MOST = 1.1


def least_of(of_rust, of_python, at_most: float) -> tuple[float, float]:
    """The least time of either side."""
    rust = python = float("inf")
    for done in range(1, MOST_ROUNDS + 1):
        rust, python = min(rust, of_rust()), min(python, of_python())
        if done >= ROUNDS and python / rust <= at_most:
            break
    return rust, python


def test_push_of_an_array(oven, calibration, tmp_path, capsys):
    program = os.environ.get("DRIFT_PUSH")
    if program is None:
        pytest.skip("DRIFT_PUSH names examples/push.rs, built; .ci/python does")
    run = drift.simulate(oven, duration_s=10_000_000, reference_mean=35.0, reference_sd=3.0, reference_hold=200)
    pandas.DataFrame(run.to_dict()).to_csv(tmp_path / "run.csv", index=False)
    calibration.baseline.save(tmp_path / "baseline.toml")

    def of_rust():
        arguments = [program, tmp_path / "baseline.toml", tmp_path / "run.csv", "5"]
        seconds, decided = subprocess.run(arguments, capture_output=True, text=True, check=True).stdout.split()
        assert int(decided) == 10_000
        return float(seconds)

    def of_python():
        best = float("inf")
        for _ in range(5):
            monitor = drift.Monitor(calibration)
            begun = time.perf_counter()
            decisions = monitor.push(run.r, run.y, run.u)
            best = min(best, time.perf_counter() - begun)
            assert len(decisions) == 10_000
        return best

    rust, python = least_of(of_rust, of_python, PUSH_AT_MOST)
    with capsys.disabled():
        print(f"\npush of {len(run)} samples: {1e9 * rust / len(run):.2f} ns a sample in Rust, {python / rust:.3f} times that in Python")
    assert python / rust <= PUSH_AT_MOST


def test_diagnose(oven, root, command, tmp_path, capsys):
    """Instructions, not seconds: the command and the package are two builds, and what else a machine did made 0.98 to 1.24 of the same ratio in seconds."""
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        pytest.skip("valgrind counts the instructions; .ci/python installs it")
    faulty = oven.with_physics("sensor_bias", bias=2.0, onset_s=9000.0)
    run = drift.simulate(faulty, duration_s=20_000, seed=2, reference_mean=35.0, reference_sd=3.0, reference_hold=200)
    path, loop = tmp_path / "run.csv", root / "examples/loops/oven.toml"
    pandas.DataFrame(run.to_dict()).to_csv(path, index=False)

    def instructions(*arguments) -> int:
        counted = [valgrind, "--tool=callgrind", "--callgrind-out-file=/dev/null", *arguments]
        said = subprocess.run(counted, capture_output=True, text=True, check=True).stderr
        return int(re.search(r"Collected : (\d+)", said)[1])

    imports = "import sys, drift; from pathlib import Path"
    python = [sys.executable, "-P", "-c"]
    rust = instructions(command, "diagnose", path, "--loop", loop)
    diagnosed = instructions(*python, f"{imports}; drift.diagnose(Path(sys.argv[1]), Path(sys.argv[2]))", path, loop)
    ratio = (diagnosed - instructions(*python, imports)) / rust
    with capsys.disabled():
        print(f"\ndiagnose: {rust / 1e9:.2f} G instructions by the command, {ratio:.3f} times that in Python")
    assert ratio <= DIAGNOSE_AT_MOST
