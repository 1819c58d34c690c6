"""What results say and show: attributes, words, pages, pictures."""

import html.parser
import threading

import matplotlib.pyplot as plt
import numpy as np
import pandas
import pytest

import drift


class Balanced(html.parser.HTMLParser):
    """Counts the elements that are open; void ones never are."""

    VOID = {"meta", "path", "circle", "rect", "line", "br"}

    def __init__(self):
        super().__init__()
        self.open, self.seen = [], set()

    def handle_starttag(self, tag, attrs):
        self.seen.add(tag)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag


def fragment(result) -> str:
    text = result._repr_html_()
    parsed = Balanced()
    parsed.feed(text)
    assert parsed.open == []
    assert {"style", "h1", "ul", "svg"} <= parsed.seen
    assert not {"html", "body", "script", "link"} & parsed.seen
    assert text.startswith('<div class="drift-answer">')
    return text


def drawn(figure) -> int:
    figure.canvas.draw()
    count = sum(len(axis.lines) + len(axis.collections) + len(axis.patches) for axis in figure.axes)
    plt.close(figure)
    return count


@pytest.fixture(scope="module")
def faulty(oven):
    """The thermometer reads 2 degC too much from half of the run on."""
    return oven.with_physics("sensor_bias", bias=2.0, onset_s=200_000.0)


@pytest.fixture(scope="module")
def watched(faulty, calibration):
    run = drift.simulate(faulty, duration_s=400_000, seed=3, reference_mean=35.0, reference_sd=3.0, reference_hold=200)
    return run, drift.monitor(run.to_recording("biased"), calibration)


@pytest.fixture(scope="module")
def diagnosis(oven):
    faulty = oven.with_physics("sensor_bias", bias=2.0, onset_s=9000.0)
    run = drift.simulate(faulty, duration_s=20_000, seed=2, reference_mean=35.0, reference_sd=3.0, reference_hold=200)
    return drift.diagnose(run.to_recording("biased"), oven)


def test_calibration(calibration):
    assert calibration.answer.status == "learnt"
    assert [channel.kind for channel in calibration.channels] == ["energy_error", "effort", "activity"]
    effort = calibration.channels[1]
    # Heat is lost in proportion to the temperature: the line explains nearly all of u.
    assert 0.9 < effort.r2 < 1
    assert calibration.answer.sentence in " ".join(repr(calibration).split())
    assert "400 windows" in fragment(calibration)
    assert drawn(calibration.plot()) > 3
    baseline = drift.Baseline.from_toml(calibration.baseline.to_toml())
    assert baseline.window_s == 1000.0
    assert "#define" in baseline.to_c() or "drift_" in baseline.to_c()


def test_monitoring(watched):
    _, found = watched
    assert found.verdict == "drift"
    event = next(event for event in found.events if event.kind == "drift")
    assert 200_000 <= event.alarm_s <= 230_000
    assert event.to_s is None
    assert "DRIFT" in repr(found)
    assert "biased" in fragment(found)
    assert drawn(found.plot()) > 10
    assert found.to_html().startswith("<!DOCTYPE html>")


def test_pushing_is_watching(watched, calibration):
    run, found = watched
    whole = drift.Monitor(calibration)
    in_parts = drift.Monitor(calibration)
    single = drift.Monitor(calibration)
    decisions = whole.push(run.r, run.y, run.u)
    expected = [decision.to_dict()["channels"] for decision in found.decisions]
    assert [decision.to_dict()["channels"] for decision in decisions] == expected
    parts = [in_parts.push(run.r[i : i + 777], run.y[i : i + 777], run.u[i : i + 777]) for i in range(0, len(run), 777)]
    assert [decision.to_dict() for part in parts for decision in part] == [d.to_dict() for d in decisions]
    one_by_one = [single.push(*sample) for sample in zip(run.r, run.y, run.u, strict=True)]
    assert [decision.to_dict() for decision in one_by_one if decision] == [d.to_dict() for d in decisions]
    assert decisions[-1].verdict == "drift"
    assert decisions[-1].channels[1].side in ("high", "low")
    # Single precision is what the monitor computes in; other strides are the same samples.
    singles = drift.Monitor(calibration).push(*(signal.astype(np.float32) for signal in (run.r, run.y, run.u)))
    assert [d.to_dict() for d in singles] == [d.to_dict() for d in decisions]
    wide = np.column_stack([run.r, run.y, run.u])
    assert [d.to_dict() for d in drift.Monitor(calibration).push(*wide.T)] == [d.to_dict() for d in decisions]


def test_decisions_in_columns_are_those_one_by_one(watched, calibration):
    run, _ = watched
    decisions = drift.Monitor(calibration).push(run.r, run.y, run.u)
    columns = decisions.to_dict()
    assert len({len(column) for column in columns.values()}) == 1
    for name in ("hop", "from_s", "to_s", "status", "verdict", "location"):
        assert list(columns[name]) == [getattr(decision, name) for decision in decisions]
    for place, channel in enumerate(decisions[0].channels):
        of = [decision.channels[place] for decision in decisions]
        assert columns[f"{channel.kind}_verdict"] == [channel.verdict for channel in of]
        for number in ("x", "value", "residual", "z"):
            column = columns[f"{channel.kind}_{number}"]
            np.testing.assert_array_equal(column, np.array([getattr(channel, number) for channel in of], np.float32))
    assert repr(decisions) == f"<Decisions: {len(decisions)}, the last drift at 400000 s>"
    assert [decision.hop for decision in decisions[-2:]] == [decisions[-2].hop, decisions[-1].hop]
    assert decisions[0].hop in [decision.hop for decision in reversed(decisions)]
    with pytest.raises(IndexError):
        decisions[len(decisions)]
    none = drift.Monitor(calibration).push([], [], [])
    assert (len(none), list(none), repr(none)) == (0, [], "<Decisions: none>")
    assert list(none.to_dict()["to_s"]) == []


def test_scalars_of_numpy_and_masked_arrays_are_samples_too(calibration):
    monitor = drift.Monitor(calibration)
    assert monitor.push(np.float32(1.0), np.float32(1.0), np.int64(1)) is None
    assert monitor.samples == 1
    masked = np.ma.masked_array(np.ones(200), mask=np.arange(200) < 50)
    assert drift.Monitor(calibration).push(masked, np.ones(200), np.ones(200))[0].to_dict()["excluded"]["missing"] == 50
    nulls = pandas.Series([None] * 50 + [1.0] * 150, dtype="Float64")
    assert drift.Monitor(calibration).push(nulls, np.ones(200), np.ones(200))[0].to_dict()["excluded"]["missing"] == 50


def test_a_monitor_refuses_what_it_cannot_take(calibration):
    monitor = drift.Monitor(calibration)
    with pytest.raises(drift.DriftError, match="r, y and u have 3, 2 and 3 values; equally many"):
        monitor.push([1.0] * 3, [1.0] * 2, [1.0] * 3)
    with pytest.raises(TypeError, match="one dimension"):
        monitor.push(np.ones((2, 2)), np.ones((2, 2)), np.ones((2, 2)))
    with pytest.raises(drift.DriftError, match="without an operating point"):
        monitor.operating_point(20.0)
    with pytest.raises(drift.DriftError, match="sampled every 1 s"):
        drift.Monitor(calibration, sample_time_s=1.0)
    for sample_time_s, start_s, said in [(float("nan"), 0.0, "every NaN s"), (5.0, float("nan"), "start_s is NaN; a finite")]:
        with pytest.raises(drift.DriftError, match=said):
            drift.Monitor(calibration, sample_time_s=sample_time_s, start_s=start_s)
    with pytest.raises(TypeError, match="not complex"):
        monitor.push(np.ones(3) * 1j, np.ones(3), np.ones(3))
    assert monitor.samples == 0
    manual = [monitor.push_manual() for _ in range(200)]
    assert manual[-1].status == "too_few_valid"
    missing = monitor.push(np.full(200, np.nan), np.ones(200), np.ones(200))
    assert missing[0].to_dict()["excluded"]["missing"] == 200


def test_diagnosis(diagnosis, oven):
    assert diagnosis.verdict in ("missing_physics", "located")
    found = {finding.kind for finding in diagnosis.physics} | set(diagnosis.candidates)
    assert found
    assert diagnosis.answer.sentence in " ".join(repr(diagnosis).split())
    assert "biased" in fragment(diagnosis)
    assert drawn(diagnosis.plot()) > 3
    assert {number.name for number in diagnosis.parameters} >= {"plant.gain", "plant.time_constant_s"}
    assert diagnosis.nominal.sample_time_s == oven.sample_time_s
    assert drift.Loop.from_toml(diagnosis.improved.to_toml()) == diagnosis.improved
    assert "<!DOCTYPE html>" in diagnosis.to_html()
    for finding in diagnosis.physics:
        assert finding.says
        for number in finding.parameters:
            assert number.ci95 is None or number.ci95[0] <= number.value <= number.ci95[1]


def test_signals_are_drawn(healthy, oven):
    assert drawn(healthy.plot()) == 3
    run = drift.simulate(oven, np.full(10, 30.0))
    assert drawn(run.plot()) == 3
    assert drawn(drift.look(run.to_recording()).plot()) == 3


def test_a_missing_matplotlib_is_named(healthy, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    with pytest.raises(ModuleNotFoundError, match="pip install matplotlib"):
        healthy.plot()


def test_several_threads_work_side_by_side(oven, healthy):
    """The interpreter's lock is free while Rust computes: all threads come to the same."""
    found = []
    threads = [threading.Thread(target=lambda: found.append(drift.calibrate(healthy, window_s=1000.0))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({str(calibration.to_dict()) for calibration in found}) == 1
