"""One recording: a family's loop with terms, a reference and noises, from steady operation on."""
import numpy as np

import kinds
import noises
import simulate

LAWS = {"pi": simulate.PI, "pid": simulate.PID, "p-velocity": simulate.P_VELOCITY}


def law_numbers(law):
    second = law["kv"] if law["kind"] == "p-velocity" else law["ki"]
    return np.array([LAWS[law["kind"]], law["kp"], second, law.get("kd", 0.0), law.get("derivative_filter_s", 0.0), law["u_min"], law["u_max"]])


def body(plant):
    """(model, numbers, A, B, C) of the simulator."""
    a, b, c = np.zeros((4, 4)), np.zeros(4), np.zeros(4)
    kind = plant["kind"]
    if kind == "servo":
        return simulate.SERVO, np.array([plant["inertia"], plant["viscous"], plant["actuator_gain"], float(plant["output"] == "speed")]), a, b, c
    if kind == "tank":
        return simulate.TANK, np.array([plant["area"], plant["inflow_gain"], plant["outflow"], 0]), a, b, c
    number = np.array([plant.get("gain", 1.0), plant.get("offset", 0.0), 0, 0])
    if kind == "first-order":
        a[0, 0], b[0], c[0] = -1 / plant["time_constant_s"], 1 / plant["time_constant_s"], 1
    elif kind == "transfer-function":  # the observable form: the first state is y
        den = np.array(plant["den"]) / plant["den"][0]
        num = np.array(plant["num"]) / plant["den"][0]
        order = len(den) - 1
        for i in range(order):
            a[i, 0] = -den[i + 1]
            if i + 1 < order:
                a[i, i + 1] = 1
        b[order - len(num) : order] = num
        c[0] = 1
    else:
        order = len(plant["a"])
        a[:order, :order], b[:order], c[:order] = plant["a"], np.ravel(plant["b"]), np.ravel(plant["c"])
    return simulate.LINEAR, number, a, b, c


def at_rest(model, number, a, b, c, y):
    """(state, u) that hold y without any term."""
    z = np.zeros(simulate.STATES)
    if model == simulate.SERVO:
        z[1 if number[3] else 0] = y
        u = number[1] * y / number[2] if number[3] else 0.0
    elif model == simulate.TANK:
        z[0], u = y, number[2] * np.sqrt(y) / number[1]
    else:
        order = max(int(np.count_nonzero(np.any(a, axis=1) | (b != 0))), 1)
        # A x + B drive = 0, C x = y.
        left = np.block([[a[:order, :order], b[:order, None]], [c[None, :order], np.zeros((1, 1))]])
        solved = np.linalg.solve(left, np.r_[np.zeros(order), y])
        z[:order], u = solved[:order], (solved[order] - number[1]) / number[0]
    z[simulate.SENSOR], z[simulate.LAG], z[simulate.MODE] = y, u, u
    return z, u


def record(rng, family, reference, terms=(), process="none", process_sd=0.0, colour=0.0, lattice=0.0, noise_sd=None):
    """(y, u) under the reference. The recording begins in steady operation at the reference's first value, noise and those terms
    that have no onset at work for some time already."""
    before = int(family.settle / family.sample_time)
    r = np.concatenate([np.full(before, reference[0]), reference])
    load, load_end = noises.process(rng, process, len(r), family)
    noise = noises.ar1(rng, len(r), colour)
    model, number, a, b, c = body(family.plant)
    z, u = at_rest(model, number, a, b, c, reference[0])
    e, spans = kinds.rows(terms)
    y, u, _ = simulate.run(r, family.sample_time, family.steps, before, model, number, a, b, c, family.plant.get("delay_s", 0.0), law_numbers(family.law), e, spans,
                           noise, family.noise_sd if noise_sd is None else noise_sd, lattice, process_sd * load, process_sd * load_end, z, u, int(rng.integers(2**31)))
    return y[before:], u[before:]
