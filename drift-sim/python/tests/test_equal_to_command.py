"""The same input gives the same numbers as the command, to the bit, on ten recordings."""

import json

import pandas
import pytest

import drift

OVEN = ("--reference-mean", 35, "--reference-sd", 3, "--reference-hold", 200)
SERVO = ("--reference-mean", 0, "--reference-sd", 0.05, "--reference-hold", 250)
HEATER = ("--reference-mean", 55, "--reference-sd", 3, "--reference-hold", 1200)
# A name, its loop file, physics beside it, and what is asked of the run.
RECORDINGS = [
    ("oven", "oven", "", (*OVEN, "--duration", 20_000)),
    ("oven_bias", "oven", "sensor_bias\nbias = 2.0\nonset_s = 9000.0", (*OVEN, "--duration", 20_000, "--seed", 2)),
    ("oven_gain", "oven", "gain_loss\nloss = 0.2", (*OVEN, "--duration", 15_000, "--seed", 3)),
    ("servo", "servo", "", (*SERVO, "--duration", 4)),
    ("servo_viscous", "servo", "viscous_friction\nratio = 1.5", (*SERVO, "--duration", 4, "--seed", 5)),
    ("heater", "heater", "", (*HEATER, "--duration", 14_400, "--seed", 6)),
    ("heater_step", "heater", "load_step\nlevel = 4.0\nonset_s = 6000.0", (*HEATER, "--duration", 14_400, "--seed", 7)),
    ("flow", "flow", "", ("--reference-mean", 40, "--reference-sd", 5, "--reference-hold", 60, "--seed", 8)),
    ("paper", "paper", "", ("--duration", 8, "--seed", 9)),
    ("paper_drift", "paper_drift", "", ("--duration", 8, "--seed", 10)),
]
NAMES = [name for name, *_ in RECORDINGS]


@pytest.fixture(scope="module")
def made(tmp_path_factory, root, run_command):
    """Each recording's file, the loop that it is judged by, and the loop that ran."""
    folder = tmp_path_factory.mktemp("recordings")
    files = {}
    for name, loop, physics, arguments in RECORDINGS:
        known = root / "examples/loops" / f"{loop}.toml"
        hidden = folder / f"{name}.toml"
        kind, _, numbers = physics.partition("\n")
        term = f'\n[[physics]]\nkind = "{kind}"\n{numbers}\n' if physics else ""
        hidden.write_text(known.read_text() + term)
        run_command("simulate", hidden, "-o", folder / f"{name}.csv", *arguments)
        files[name] = folder / f"{name}.csv", known, hidden
    return files


def keywords(arguments):
    """The command's options as keywords."""
    named = {"--duration": "duration_s", "--seed": "seed"}
    pairs = zip(arguments[::2], arguments[1::2], strict=True)
    return {named.get(flag, flag.strip("-").replace("-", "_")): value for flag, value in pairs}


@pytest.mark.parametrize("name", NAMES)
def test_simulate(made, name):
    path, _, hidden = made[name]
    arguments = next(arguments for n, _, _, arguments in RECORDINGS if n == name)
    run = drift.simulate(hidden, **keywords(arguments))
    written = pandas.read_csv(path, dtype=float)
    pandas.testing.assert_frame_equal(pandas.DataFrame(run.to_dict()), written, check_exact=True)


@pytest.mark.parametrize("name", NAMES)
def test_simulate_over_a_recording(made, name, run_command):
    path, known, _ = made[name]
    written = run_command("simulate", known, "--reference", path, "--seed", 4, "-o", "-")
    run = drift.simulate(known, path, seed=4)
    rows = list(zip(*run.to_dict().values(), strict=True))
    for here, there in zip(rows, written.splitlines()[1:], strict=True):
        assert [float(x) for x in here] == [float(x) for x in there.split(",")]



@pytest.mark.parametrize(
    "name", [name if name.startswith("oven") else pytest.param(name, marks=pytest.mark.long) for name in NAMES]
)
def test_init(made, name, run_command):
    path, *_ = made[name]
    assert drift.init(path).to_toml() == run_command("init", path)


@pytest.mark.parametrize(
    "name", ["oven", "servo", pytest.param("heater", marks=pytest.mark.long), pytest.param("flow", marks=pytest.mark.long)]
)
def test_calibrate_and_monitor(made, name, run_command, tmp_path):
    path, _, hidden = made[name]
    window_s = {"oven": 500.0, "servo": 0.1, "heater": 400.0, "flow": 20.0}[name]
    healthy, faulty = tmp_path / "healthy.csv", tmp_path / "faulty.csv"
    arguments = next(arguments for n, _, _, arguments in RECORDINGS if n == name)
    asked = {**keywords(arguments), "duration_s": 100 * window_s}
    pandas.DataFrame(drift.simulate(hidden, **asked).to_dict()).to_csv(healthy, index=False)
    worse = drift.Loop.read(hidden).with_physics("gain_loss", loss=0.3, onset_s=50 * window_s)
    pandas.DataFrame(drift.simulate(worse, **asked).to_dict()).to_csv(faulty, index=False)

    files = {"-o": tmp_path / "baseline.toml", "--json": tmp_path / "calibration.json"}
    run_command("calibrate", healthy, "--window", window_s, *(part for pair in files.items() for part in pair))
    calibration = drift.calibrate(healthy, window_s=window_s)
    assert calibration.baseline.to_toml() == files["-o"].read_text()
    assert calibration.to_dict() == json.loads(files["--json"].read_text())

    lines = run_command("monitor", faulty, "--baseline", files["-o"], "--json", "-").splitlines()
    monitored = drift.monitor(faulty, calibration)
    assert [decision.to_dict() for decision in monitored.decisions] == [json.loads(line) for line in lines[:-1]]
    assert monitored.summary == json.loads(lines[-1])["summary"]
    # The same of arrays, but for the last digits of times.
    in_memory = drift.monitor(drift.Recording.read(faulty), calibration)
    assert [d.to_dict()["channels"] for d in in_memory.decisions] == [d.to_dict()["channels"] for d in monitored.decisions]


def diagnosed_equal(run_command, diagnosis, *arguments):
    written = json.loads(run_command("diagnose", *arguments, "--json", "-"))
    assert json.dumps(diagnosis.to_dict()) == json.dumps(written)


def test_diagnose_one(made, run_command):
    path, known, _ = made["oven_bias"]
    diagnosed_equal(run_command, drift.diagnose(path, known), path, "--loop", known)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in NAMES if name != "oven_bias"])
def test_diagnose(made, name, run_command):
    path, known, _ = made[name]
    table = pandas.read_csv(path, dtype=float)
    recording = drift.Recording.from_table(table, name=str(path))
    diagnosed_equal(run_command, drift.diagnose(recording, known), path, "--loop", known)


@pytest.mark.long
def test_diagnose_with_all_that_there_is(made, run_command):
    healthy, known, _ = made["oven"]
    path, *_ = made["oven_bias"]
    holdout, *_ = made["oven_gain"]
    here = drift.diagnose(path, known, holdout=holdout, healthy=[healthy])
    diagnosed_equal(run_command, here, path, "--loop", known, "--holdout", holdout, "--healthy", healthy)


@pytest.mark.long
def test_diagnose_without_a_loop(made, run_command):
    path, *_ = made["oven_gain"]
    diagnosed_equal(run_command, drift.diagnose(path), path)


@pytest.mark.parametrize(
    "asked",
    [
        {"k": 0.5, "h": 5.0, "shift": 1.0},
        pytest.param({"k": 0.5, "arl0": 2000.0, "windows": 200.0, "hop_s": 3.0}, marks=pytest.mark.long),
        {"k": 0.5, "arl0": 2000.0, "hop_s": 3.0},
        {"detector": "shewhart", "arl0": 2000.0, "shift": 2.0, "mission": 100},
        {"detector": "ewma", "arl0": 500.0},
        {"detector": "sprt", "k": 0.5, "h": 5.0},
    ],
)
def test_design(asked, run_command):
    arguments = [part for name, value in asked.items() for part in (f"--{name.replace('_', '-')}", value)]
    written = json.loads(run_command("design", *arguments, "--json", "-"))
    assert drift.design(**asked).to_dict() == written


@pytest.mark.parametrize(
    ("asked", "arguments"), [({"h": 5.0}, ("--h", 5)), ({"k": 0.5, "h": 500.0}, ("--k", 0.5, "--h", 500))]
)
def test_design_refuses_in_the_same_words(asked, arguments, run_command):
    with pytest.raises(drift.DriftError) as here:
        drift.design(**asked)
    with pytest.raises(RuntimeError) as there:
        run_command("design", *arguments)
    assert f"error: {here.value}" == str(there.value)
