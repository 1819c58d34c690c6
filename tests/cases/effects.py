"""The effects: which families show a kind, and how large it is drawn, relative to what the loop does in its usual motion."""
import numpy as np

POSITION, MASS = ["axis", "arm"], ["axis", "arm", "motor"]
PROCESS = ["heater", "flow", "pressure", "two-lags", "tank"]
ALL = [*MASS, *PROCESS, "level", "oscillator"]
CENTRED = [*MASS, "level", "oscillator"]  # u lies around zero

# kind: (families, draw(size, scales, plant) -> parameters, when it begins: "start", "later")
EFFECTS = {
    "coulomb_friction": (MASS, lambda s, k, p: dict(level=s(0.25, 0.8) * k.drive), "start"),
    "stribeck_friction": (MASS, lambda s, k, p: stribeck(s(0.2, 0.4) * k.drive, s(0.3, 0.6) * k.drive, s(0.08, 0.2) * k.speed), "start"),
    "directional_friction": (MASS, lambda s, k, p: dict(coulomb_pos=s(0.3, 0.8) * k.drive, coulomb_neg=s(0.1, 0.3) * k.drive, viscous_pos=s(-0.2, 0.5) * p["viscous"], viscous_neg=s(-0.2, 0.5) * p["viscous"]), "start"),
    "load_dependent_friction": (POSITION, lambda s, k, p: dict(coefficient=s(0.2, 0.5)), "start"),
    "quadratic_drag": (["motor", "arm"], lambda s, k, p: dict(coefficient=s(0.4, 1.0) * k.drive / k.speed**2), "start"),
    "viscous_friction": (MASS, lambda s, k, p: dict(ratio=s(1.5, 2.5)), "later"),
    "inertia_change": (MASS, lambda s, k, p: dict(ratio=s(1.3, 1.6)), "later"),
    "cogging": (MASS, lambda s, k, p: dict(amplitude=s(0.2, 0.5) * k.drive, period=s(0.3, 0.8) * {"axis": 0.1, "arm": 0.8, "motor": 15}[k.family], phase=s(0, 6.28)), "start"),
    "stiffness": (POSITION, lambda s, k, p: dict(stiffness=s(0.6, 2) * k.drive / k.y), "start"),
    "gravity": (["arm"], lambda s, k, p: dict(amplitude=s(0.6, 2) * k.drive, phase=s(-0.5, 0.5)), "start"),
    "radiation": (["heater"], lambda s, k, p: dict(coefficient=s(0.8, 1.6) * 2.5e-9), "start"),
    "leak": (["heater", "flow", "level", "pressure", "two-lags", "tank"], lambda s, k, p: dict(coefficient=s(0.6, 1.2) * k.drive / k.centre), "later"),
    "injected_signal": (ALL, lambda s, k, p: dict(level=s.sign() * s(0.4, 1) * k.u), "start"),
    "saturation": ([*MASS, "oscillator", "level", "pressure", "two-lags", "heater", "tank"], lambda s, k, p: limits(k, s(0.45, 0.7)), "start"),
    "dead_zone": (CENTRED, lambda s, k, p: dict(half_width=s(0.15, 0.4) * k.u), "start"),
    "backlash": (["flow", "heater", "motor", "level", "two-lags", "tank"], lambda s, k, p: dict(width=s(0.3, 0.8) * k.u), "start"),
    "stiction": (["flow", "level", "two-lags", "pressure"], lambda s, k, p: stiction(s(0.4, 0.9) * k.u, s(0.1, 0.5)), "start"),
    "gain_loss": (ALL, lambda s, k, p: dict(loss=s(0.15, 0.4)), "later"),
    "nonlinear_gain": (["arm", "motor", *PROCESS], lambda s, k, p: dict(exponent=s.either((0.7, 0.85), (1.2, 1.5)) if k.family in MASS else s.either((0.88, 0.95), (1.06, 1.15))), "start"),
    "delay": ([*MASS, "oscillator", "two-lags", "pressure", "tank", "level"], lambda s, k, p: dict(delay_s=s(0.6, 1.5) * k.late), "start"),
    "rate_limit": (["level", "pressure", "two-lags", "heater", "tank"], lambda s, k, p: dict(limit_per_s=s(0.35, 0.7) * k.slew), "start"),
    "unmodelled_lag": ([*MASS, "heater", "level", "tank"], lambda s, k, p: dict(time_constant_s=s(0.6, 1.4) * k.lag), "start"),
    "flexible_mode": (MASS, lambda s, k, p: dict(frequency_hz=s(0.25, 0.6) / k.lag, damping=s(0.15, 0.4)), "start"),
    "sensor_hysteresis": (["heater", "flow", "two-lags", "pressure"], lambda s, k, p: dict(width=s(0.02, 0.06) * k.y), "start"),
    "sensor_lag": (["motor", "heater", "flow", "two-lags", "tank"], lambda s, k, p: dict(time_constant_s=s(0.6, 1.4) * k.lag), "start"),
    "sensor_noise": (ALL, lambda s, k, p: dict(ratio=s(3, 7)), "later"),
    "sensor_bias": (["motor", *PROCESS, "oscillator"], lambda s, k, p: dict(bias=s.sign() * s(0.1, 0.25) * k.y), "later"),
    "sensor_drift": ([*PROCESS, "level", "oscillator"], lambda s, k, p: dict(rate_per_s=s.sign() * s(0.3, 0.8) * k.y / k.duration, noise_growth_per_s=0.0), "later"),
    "quantization": (["motor", *PROCESS, "level"], lambda s, k, p: dict(step=s(8, 20) * k.noise), "start"),
    "load_step": (ALL, lambda s, k, p: dict(level=s.sign() * s(0.3, 0.8) * k.drive), "later"),
    "load_ramp": (["motor", *PROCESS, "level"], lambda s, k, p: dict(rate_per_s=s.sign() * s(0.6, 1.2) * k.drive / k.duration), "later"),
    "periodic_load": (ALL, lambda s, k, p: dict(amplitude=s(0.2, 0.5) * k.drive, frequency_hz=s(0.5, 1.5) * k.wave_hz), "start"),
    "controller_gain": (ALL, lambda s, k, p: dict(ratio=s.either((0.6, 0.8), (1.25, 1.6))), "start"),
    "controller_delay": ([*MASS, "heater", "two-lags", "pressure"], lambda s, k, p: dict(delay_s=s(0.6, 1.5) * k.late), "start"),
}
# The second effect that may come with a first; it begins at its own time.
SECOND = {
    "coulomb_friction": "load_step", "gravity": "coulomb_friction", "cogging": "coulomb_friction", "stiffness": "coulomb_friction", "backlash": "load_ramp", "stiction": "load_step",
    "saturation": "periodic_load", "gain_loss": "sensor_noise", "unmodelled_lag": "load_step", "radiation": "load_ramp", "sensor_bias": "gain_loss",
    "nonlinear_gain": "load_step", "delay": "periodic_load", "quantization": "load_step", "flexible_mode": "coulomb_friction", "load_step": "sensor_noise",
}


class Scales:
    """What the loop does in its usual motion without any effect: u and y around their middle, drive, speed, slew of u."""

    def __init__(self, family, y, u):
        self.family, self.noise, self.lag, self.late, self.wave_hz = family.name, family.noise_sd, family.lag, family.late, family.wave_hz
        self.duration, self.centre = family.samples * family.sample_time, family.centre
        self.u, self.y = np.std(u), np.std(y)
        self.drive = family.of_drive(self.u)
        self.middle = 0.0 if family.name in CENTRED else np.median(u)
        self.reach = np.quantile(np.abs(u - self.middle), 0.995)
        speed = y if family.plant.get("output") == "speed" else np.gradient(y, family.sample_time)
        self.speed = np.sqrt(np.mean(speed**2))
        apart = max(int(family.slow / 4 / family.sample_time), 1)
        self.slew = np.quantile(np.abs(u[apart:] - u[:-apart]), 0.98) / (apart * family.sample_time)


class Size:
    """Draws sizes."""

    def __init__(self, rng):
        self.rng = rng

    def __call__(self, low, high):
        return float(self.rng.uniform(low, high))

    def sign(self):
        return float(self.rng.choice([-1, 1]))

    def either(self, one, other):
        return self(*(one if self.rng.random() < 0.5 else other))


def stribeck(coulomb, excess, speed):
    return dict(coulomb=coulomb, breakaway=coulomb + excess, stribeck_speed=speed)


def stiction(band, part):
    return dict(stick_band=band, slip_jump=part * band)


def limits(scales, part):
    return dict(lower=scales.middle - part * scales.reach, upper=scales.middle + part * scales.reach)


def draw(rng, kind, scales, family):
    """A term of this kind for this loop."""
    _, size, begins = EFFECTS[kind]
    params = {name: float(value) for name, value in size(Size(rng), scales, family.plant).items()}
    onset = 0.0
    if begins == "later":
        onset = float(np.round(rng.uniform(0.25, 0.6) * family.samples) * family.sample_time)
    term = dict(kind=kind, params=params, onset_s=onset)
    if kind == "injected_signal":
        marks = np.sort(rng.uniform(0.1, 0.9, 4)) * scales.duration
        term["spans"] = [[float(marks[0]), float(marks[1])], [float(marks[2]), float(marks[3])]]
    return term
