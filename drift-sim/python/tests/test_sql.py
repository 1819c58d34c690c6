"""drift's functions in the SQL of Python's datafusion package."""

import json

import datafusion
import numpy as np
import pandas
import pyarrow
import pytest

import drift
import drift.sql

LEVELS = {"reference_mean": 35.0, "reference_sd": 3.0, "reference_hold": 200}
ODD = "boiler <2>/FIC'101"


@pytest.fixture(scope="module")
def plant(oven, calibration, tmp_path_factory):
    """Three loops of which one drifts, one has an odd name and one has no baseline: rows by turns, and a folder of baselines."""
    folder = tmp_path_factory.mktemp("plant")
    weak = oven.with_physics("gain_loss", loss=0.2, onset_s=100_000.0)
    runs = {"A": (weak, 1), ODD: (oven, 2), "C": (oven, 3)}
    rows = []
    for name, (loop, seed) in runs.items():
        run = drift.simulate(loop, duration_s=200_000, seed=seed, **LEVELS)
        rows.append(pandas.DataFrame({"loop": name, "t": run.t, "r": run.r, "y": run.y, "u": run.u}))
    for name in ("A", ODD):
        calibration.baseline.save(drift.sql.baseline_path(folder, name))
    return pandas.concat(rows).sample(frac=1.0, random_state=5), folder


@pytest.fixture
def session(plant):
    """Four parts, so that rows of one loop meet."""
    context = datafusion.SessionContext(datafusion.SessionConfig().with_target_partitions(4))
    drift.sql.register(context)
    table = pyarrow.Table.from_pandas(plant[0], preserve_index=False)
    context.register_record_batches("lake", [[batch] for batch in table.to_batches(max_chunksize=9000)])
    return context


def asked(context, sql):
    return context.sql(sql).to_pylist()


def test_a_verdict_is_the_commands_to_the_byte(session, plant, run_command, tmp_path):
    rows, folder = plant
    found = asked(
        session,
        f"SELECT loop, drift_verdict('{folder}', loop, t, r, y, u) AS verdict FROM lake GROUP BY loop ORDER BY loop",
    )
    by_loop = {row["loop"]: row["verdict"] for row in found}
    assert by_loop["A"]["status"] == "drift"
    assert 95_000 <= by_loop["A"]["since_s"] <= 105_000
    assert by_loop["A"]["samples"] == 40_000
    # It warms up at first.
    assert by_loop[ODD]["status"] == "disturbance"
    assert by_loop["C"] == {
        **dict.fromkeys(by_loop["A"]),
        "status": "no_baseline",
        "answer": f"{drift.sql.baseline_path(folder, 'C')} is missing",
    }
    of_one = rows[rows.loop == "A"].sort_values("t")
    of_one[["t", "r", "y", "u"]].to_csv(tmp_path / "A", index=False)
    lines = run_command("monitor", "A", "--baseline", drift.sql.baseline_path(folder, "A"), "--json", "-", folder=tmp_path)
    assert by_loop["A"]["summary"] == lines.splitlines()[-1]
    assert json.loads(by_loop["A"]["summary"])["summary"]["answer"]["sentence"] == by_loop["A"]["answer"]


def test_a_block_is_its_means(session, plant):
    rows, _ = plant
    found = asked(session, "SELECT floor(t / 50000) AS hour, drift_block(t, r, y, u) AS b FROM lake WHERE loop = 'A' GROUP BY 1 ORDER BY 1")
    of_one = rows[rows.loop == "A"]
    assert len(found) == 4
    for row in found:
        part, block = of_one[of_one.t // 50_000 == row["hour"]], row["b"]
        e = part.r - part.y
        means = {"mean_r": part.r, "mean_y": part.y, "mean_u": part.u, "mean_e": e, "mean_abs_e": e.abs(), "mean_u2": part.u**2}
        for name, values in means.items():
            assert block[name] == pytest.approx(values.mean(), abs=1e-9)
        assert block["rms_e"] == pytest.approx(np.sqrt((e**2).mean()))
        assert (block["samples"], block["from_s"], block["to_s"]) == (len(part), part.t.min(), part.t.max())
        assert (block["least_u"], block["greatest_y"]) == (part.u.min(), part.y.max())


def test_no_rows_and_bad_rows(session, plant):
    _, folder = plant
    assert asked(session, f"SELECT drift_verdict('{folder}', loop, t, r, y, u) AS v FROM lake WHERE t < 0") == [{"v": None}]
    for rows in ("lake WHERE t < 0", "(SELECT t, r, y, u / 0.0 - u / 0.0 AS u FROM lake)"):
        nothing = asked(session, f"SELECT drift_block(t, r, y, u) AS b FROM {rows}")[0]["b"]
        assert set(nothing.values()) == {None}
    twice = asked(session, f"SELECT drift_verdict('{folder}', 'A', t, r, y, u) AS v FROM lake")[0]["v"]
    assert twice["status"] == "error"
    assert "the time 0 s again" in twice["answer"]
    unnamed = asked(session, f"SELECT drift_verdict('{folder}', NULL, t, r, y, u) AS v FROM lake")[0]["v"]
    assert unnamed["answer"] == "rows that name no loop or no folder of baselines"
