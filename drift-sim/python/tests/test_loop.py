"""Loops: text, dicts, and the linear systems of other libraries, both ways."""

import control
import numpy as np
import pytest
import scipy.signal

import drift

PID = {"kind": "pid", "kp": 1.0, "ki": 2.0, "kd": 0.1, "derivative_filter_s": 0.01, "u_max": 10.0}


def loop(plant) -> drift.Loop:
    return drift.Loop.from_dict({"loop": {"sample_time_s": 0.1}, "controller": PID, "plant": plant})


@pytest.mark.parametrize("name", ["flow", "heater", "oven", "paper", "paper_drift", "servo"])
def test_a_loop_file_is_its_text_and_its_dict(root, name):
    read = drift.Loop.read(root / "examples/loops" / f"{name}.toml")
    assert drift.Loop.from_toml(read.to_toml()) == read
    assert drift.Loop.from_dict(read.to_dict()) == read
    assert read != loop({"kind": "identify"})
    assert name in repr(read)


def test_numpy_numbers_and_text_survive():
    made = drift.Loop.from_dict({
        "loop": {"sample_time_s": np.float32(0.5)},
        "units": {"y": 'a "quoted" \N{DEGREE SIGN}C'},
        "controller": {"kind": "pi", "kp": np.int64(2), "ki": 1, "anti_windup": np.bool_(False)},
        "plant": {"kind": "transfer-function", "num": np.array([1.0]), "den": (1, 2)},
        "sensor": None,
    })
    tables = made.to_dict()
    assert tables["units"]["y"] == 'a "quoted" \N{DEGREE SIGN}C'
    assert tables["controller"]["anti_windup"] is False
    assert tables["plant"]["den"] == [1.0, 2.0]


@pytest.mark.parametrize(
    ("tables", "line"),
    [
        ({}, "loop: the table [loop] is missing; needed: [loop], [controller], [plant]"),
        ({"lop": {}}, "lop"),
    ],
)
def test_a_faulty_dict_is_refused_in_one_line(tables, line):
    with pytest.raises(drift.DriftError) as refused:
        drift.Loop.from_dict(tables)
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_toml_cannot_hold_is_a_type_error():
    with pytest.raises(TypeError, match="loop.sample_time_s is a complex"):
        drift.Loop.from_dict({"loop": {"sample_time_s": 1j}})
    with pytest.raises(TypeError, match="made by"):
        drift.Loop()


def response(plant) -> np.ndarray:
    """What the simulator makes of a step of u, one value a sample; against python-control's own step."""
    made = drift.Loop.from_dict({
        "loop": {"sample_time_s": 0.1},
        "controller": {"kind": "recorded"},
        "plant": plant,
    })
    t = np.arange(200) * 0.1
    u = np.ones(200)
    # From rest: y = 0 and u = 0 before the step.
    u[0] = 0.0
    run = drift.simulate(made, drift.Recording(t, np.zeros(200), np.zeros(200), u))
    return run.y


SYSTEMS = [
    control.tf([2.0], [3.0, 1.0]),
    control.tf([1.0, 4.0], [1.0, 1.2, 4.0]),
    control.ss([[-0.5, 2.0], [-2.0, -0.5]], [[1.0], [0.0]], [[1.0, 0.3]], [[0.0]]),
    scipy.signal.TransferFunction([2.0], [3.0, 1.0]),
    scipy.signal.ZerosPolesGain([-4.0], [-1.0, -2.0], 3.0),
    scipy.signal.StateSpace([[-0.5, 2.0], [-2.0, -0.5]], [[1.0], [0.0]], [[1.0, 0.3]], [[0.0]]),
]


def dynamics(system):
    """The step response of a system, by the library that it is of."""
    t = np.arange(200) * 0.1
    if isinstance(system, control.lti.LTI):
        return control.step_response(system, t).outputs
    return scipy.signal.step(system, T=t)[1]


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: f"{type(system).__module__}.{type(system).__name__}")
def test_systems_are_plants_and_come_back(system):
    plant = drift.from_system(system)
    assert loop(system).plant["kind"] == plant["kind"]
    np.testing.assert_allclose(response(plant)[1:], dynamics(system)[:-1], atol=1e-9)
    for back in (drift.to_control(plant), drift.to_scipy(plant)):
        np.testing.assert_allclose(dynamics(back), dynamics(system), atol=1e-8)


@pytest.mark.parametrize(
    "plant",
    [
        {"kind": "servo", "output": "position", "inertia": 4.0, "viscous": 2.0, "actuator_gain": 3.0},
        {"kind": "servo", "output": "speed", "inertia": 4.0, "viscous": 2.0, "actuator_gain": 3.0},
        {"kind": "first-order", "gain": 2.0, "time_constant_s": 3.0},
    ],
)
def test_other_plants_go_out(plant):
    loop(plant)
    for system in (drift.to_control(plant), drift.to_scipy(plant)):
        np.testing.assert_allclose(response(plant)[1:], dynamics(system)[:-1], atol=1e-8)


@pytest.mark.parametrize(
    ("system", "line"),
    [
        (control.tf([1.0], [1.0, -0.5], 0.1), "discrete time"),
        (scipy.signal.dlti([1.0], [1.0, -0.5], dt=0.1), "discrete time"),
        (control.ss(np.eye(2) * -1, np.eye(2), np.eye(2), np.zeros((2, 2))), "2 inputs and 2 outputs"),
        (control.tf([[[1.0], [1.0]]], [[[1.0, 1.0], [1.0, 2.0]]]), "one of each"),
    ],
)
def test_what_is_no_plant_is_refused(system, line):
    with pytest.raises(drift.DriftError, match=line):
        drift.from_system(system)


def test_a_tank_is_not_linear():
    with pytest.raises(drift.DriftError, match="a tank plant has no linear dynamics"):
        drift.to_control({"kind": "tank", "area": 1.0})
    with pytest.raises(TypeError, match="is no linear system"):
        drift.from_system(7)


def test_inputs_are_asked_for(oven):
    tables = {**oven.to_dict(), "inputs": [{"column": "outdoor", "enters": "load"}]}
    r = np.full(50, 30.0)
    with pytest.raises(drift.DriftError, match="outdoor"):
        drift.simulate(tables, r)
    colder = drift.simulate(tables, r, inputs={"outdoor": np.full(50, 5.0)})
    assert list(colder.to_dict()) == ["t", "r", "y", "u", "outdoor"]
    assert colder.y[-1] < drift.simulate(oven, r).y[-1]


def test_an_input_is_a_product_of_columns(oven):
    product = {"column": "t_in", "minus": "t_out", "times": "flow", "enters": "load", "gain": 0.5}
    plain = {"column": "heat", "enters": "load", "gain": 0.5}
    r = np.full(50, 60.0)
    parts = {"t_in": np.linspace(20.0, 30.0, 50), "t_out": np.full(50, 18.0), "flow": np.linspace(0.0, 2.0, 50)}
    made = drift.simulate({**oven.to_dict(), "inputs": [product]}, r, inputs=parts)
    heat = (parts["t_in"] - parts["t_out"]) * parts["flow"]
    given = drift.simulate({**oven.to_dict(), "inputs": [plain]}, r, inputs={"heat": heat})
    assert np.array_equal(made.y, given.y)
    assert made.loop.inputs == ["t_in", "t_out", "flow"]
    again = drift.simulate({**oven.to_dict(), "inputs": [product]}, made.to_recording())
    assert len(again) == 50
    with pytest.raises(drift.DriftError, match="another length"):
        drift.simulate({**oven.to_dict(), "inputs": [plain]}, r, inputs={"heat": heat[:20]})
    with pytest.raises(drift.DriftError, match="still to be identified"):
        drift.simulate({**oven.to_dict(), "inputs": [{**plain, "gain": "identify"}]}, r, inputs={"heat": heat})


@pytest.mark.parametrize("duration_s", [-1.0, 0.0, float("nan")])
def test_a_run_has_a_length(oven, duration_s):
    with pytest.raises(drift.DriftError, match="a number of seconds above 0"):
        drift.simulate(oven, duration_s=duration_s)
