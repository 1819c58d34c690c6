"""The kinds of physics in the project's words: name, place, parameters. A term is a row of numbers (`rows`).

The order is the order in which terms act where more than one acts at the same place (simulate.py), so that a loop file that
lists them in this order means the same.
"""
import numpy as np

KINDS = {
    # plant
    "coulomb_friction": ("plant", ["level"]),
    "stribeck_friction": ("plant", ["coulomb", "breakaway", "stribeck_speed"]),
    "directional_friction": ("plant", ["coulomb_pos", "coulomb_neg", "viscous_pos", "viscous_neg"]),
    "load_dependent_friction": ("plant", ["coefficient"]),
    "quadratic_drag": ("plant", ["coefficient"]),
    "viscous_friction": ("plant", ["ratio"]),
    "inertia_change": ("plant", ["ratio"]),
    "cogging": ("plant", ["amplitude", "period", "phase"]),
    "stiffness": ("plant", ["stiffness"]),
    "gravity": ("plant", ["amplitude", "phase"]),
    "radiation": ("plant", ["coefficient"]),
    "leak": ("plant", ["coefficient"]),
    # between u and the plant: sample by sample, then along the way
    "injected_signal": ("disturbance", ["level"]),
    "saturation": ("actuator", ["lower", "upper"]),
    "dead_zone": ("actuator", ["half_width"]),
    "backlash": ("actuator", ["width"]),
    "stiction": ("actuator", ["stick_band", "slip_jump"]),
    "gain_loss": ("actuator", ["loss"]),
    "nonlinear_gain": ("plant", ["exponent"]),
    "delay": ("loop", ["delay_s"]),
    "rate_limit": ("actuator", ["limit_per_s"]),
    "unmodelled_lag": ("loop", ["time_constant_s"]),
    "flexible_mode": ("plant", ["frequency_hz", "damping"]),
    # between the plant and y: before the sensor's own noise, then after it
    "sensor_hysteresis": ("sensor", ["width"]),
    "sensor_lag": ("sensor", ["time_constant_s"]),
    "sensor_noise": ("sensor", ["ratio"]),
    "sensor_bias": ("sensor", ["bias"]),
    "sensor_drift": ("sensor", ["rate_per_s", "noise_growth_per_s"]),
    "quantization": ("sensor", ["step"]),
    # subtracted from the drive
    "load_step": ("disturbance", ["level"]),
    "load_ramp": ("disturbance", ["rate_per_s"]),
    "periodic_load": ("disturbance", ["amplitude", "frequency_hz"]),
    # the law
    "controller_gain": ("controller", ["ratio"]),
    "controller_delay": ("controller", ["delay_s"]),
}
INDEX = {kind: index for index, kind in enumerate(KINDS)}
ONSET = 4  # the column of a row that holds the onset in seconds; infinite: the term is absent
NOT_SCORED = {"phase", "noise_growth_per_s"}  # numbers that are not compared: an angle has many names; the growth is 0 here


def place(kind):
    return KINDS[kind][0] if kind in KINDS else None


def rows(terms):
    """The terms as the simulator takes them: one row a kind (parameters, onset), and the spans of an injected signal."""
    out = np.zeros((len(KINDS), ONSET + 1))
    out[:, ONSET] = np.inf
    spans = np.zeros((0, 2))
    for term in terms:
        row = out[INDEX[term["kind"]]]
        for column, name in enumerate(KINDS[term["kind"]][1]):
            row[column] = term["params"][name]
        # What is there from the start was there before the recording began.
        row[ONSET] = term["onset_s"] or -np.inf
        if "spans" in term:
            spans = np.array(term["spans"], float)
    return out, spans
