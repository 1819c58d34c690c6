"""Loops as they stand in machines and plants: true numbers, a law tuned to them, noise and time scales. Each is drawn by one function."""
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Family:
    """One drawn loop. Plant and law are in the words of the loop file; all times in seconds."""

    name: str
    sample_time: float
    samples: int
    plant: dict
    law: dict
    units: dict
    span: float  # of the reference's usual motion
    centre: float
    segment: float  # how long the reference holds a level or takes for a move, about
    noise_sd: float  # of the sensor
    slow: float  # time scale of the process noise
    wave_hz: float  # about the frequency of a periodic load
    lag: float  # a lag that this loop notices
    late: float  # a dead time that it notices
    settle: float  # from a start at rest to steady operation
    steps: int = 6  # of integration in a sample
    fixed: tuple = ("actuator_gain", "offset")  # numbers of the plant that the loop file has right: they set units
    drive: bool = field(init=False)  # a mass that is moved

    def __post_init__(self):
        self.drive = self.plant["kind"] == "servo"

    def of_drive(self, u):
        """How much drive a change of u makes, in the drive's unit."""
        plant = self.plant
        return abs(plant.get("actuator_gain", plant.get("inflow_gain", plant.get("gain", 1.0)))) * u


def pid(rng, kp, ki, kd, filter_s, low, high, also_pi=True):
    """A PID with derivative in half of the draws where the loop would do with a PI, else always."""
    if also_pi and rng.random() < 0.5:
        return dict(kind="pi", kp=kp, ki=ki, u_min=low, u_max=high)
    return dict(kind="pid", kp=kp, ki=ki, kd=kd, derivative_filter_s=filter_s, u_min=low, u_max=high)


def position(rng, name, inertia, viscous, gain, bandwidth, sample_time, samples, units, **scales):
    kp = bandwidth**2 * inertia / gain
    if rng.random() < 0.5:
        kv = 2 * 0.9 * bandwidth * inertia / gain
        law = dict(kind="p-velocity", kp=bandwidth / 2, kv=kv, u_min=-1e3, u_max=1e3)
    else:
        law = pid(rng, kp, 0.15 * kp * bandwidth, 1.6 * bandwidth * inertia / gain, 2 * sample_time, -1e3, 1e3, also_pi=False)
    plant = dict(kind="servo", output="position", inertia=inertia, viscous=viscous, actuator_gain=gain)
    return Family(name, sample_time, samples, plant, law, units, settle=30 / bandwidth, late=4 * sample_time, **scales)


def axis(rng):
    """A linear axis: a mass of some ten kilograms on a screw or belt, its position controlled."""
    u = rng.uniform
    units = dict(r="m", y="m", u="V", force="N")
    return position(rng, "axis", u(15, 120), u(60, 350), u(10, 60), u(25, 55), 1e-3, 16000, units,
                    span=0.22, centre=0.1, segment=1.1, noise_sd=8e-7, slow=0.2, wave_hz=0.8, lag=0.006)


def arm(rng):
    """A joint that swings over a good part of a turn."""
    u = rng.uniform
    units = dict(r="rad", y="rad", u="V", force="N m")
    return position(rng, "arm", u(0.05, 0.3), u(0.1, 0.6), u(0.5, 2), u(14, 28), 2e-3, 14000, units,
                    span=2.4, centre=0.4, segment=2.0, noise_sd=2e-5, slow=0.4, wave_hz=0.5, lag=0.012)


def motor(rng):
    """A motor's speed."""
    u = rng.uniform
    inertia, viscous, gain, wc = u(0.003, 0.03), u(0.006, 0.04), u(0.06, 0.4), u(12, 35)
    kp = wc * inertia / gain
    law = pid(rng, kp, kp * wc / 4, 0.3 * inertia / gain, 0.01, -200.0, 200.0)
    plant = dict(kind="servo", output="speed", inertia=inertia, viscous=viscous, actuator_gain=gain)
    return Family("motor", 2e-3, 14000, plant, law, dict(r="rad/s", y="rad/s", u="V", force="N m"), span=70, centre=12, segment=1.6,
                  noise_sd=0.02, slow=0.3, wave_hz=0.7, lag=0.02, late=0.008, settle=60 / wc)


def heater(rng):
    """A heater with a dead time."""
    u = rng.uniform
    gain, tau, ambient, delay = u(0.5, 1.2), u(110, 280), u(16, 26), u(4, 14)
    lam = u(0.5, 1.0) * tau / 3
    kp = tau / (gain * (lam + delay))
    law = pid(rng, kp, kp / min(tau, 4 * (lam + delay)), 0.5 * kp * delay, 0.2 * delay + 1, 0.0, 100.0)
    plant = dict(kind="first-order", gain=gain, time_constant_s=tau, delay_s=delay, offset=ambient)
    return Family("heater", 1.0, 12000, plant, law, dict(r="degC", y="degC", u="%"), span=20, centre=ambient + 27, segment=1300,
                  noise_sd=0.02, slow=250, wave_hz=0.004, lag=15, late=8, settle=8 * tau)


def flow(rng):
    """The flow behind a valve."""
    u = rng.uniform
    gain, tau, offset, delay = u(0.6, 1.5), u(3, 10), u(-4, 6), u(0.4, 2)
    kp = tau / (gain * (1.2 * tau + delay))
    law = dict(kind="pi", kp=kp, ki=kp / tau, u_min=0.0, u_max=100.0)
    plant = dict(kind="first-order", gain=gain, time_constant_s=tau, delay_s=delay, offset=offset)
    return Family("flow", 0.5, 11000, plant, law, dict(r="m3/h", y="m3/h", u="%"), span=28 * gain, centre=offset + 50 * gain, segment=110,
                  noise_sd=0.05, slow=30, wave_hz=0.02, lag=2.5, late=1.5, settle=12 * tau)


def level(rng):
    """A level that integrates what flows in less what flows out."""
    u = rng.uniform
    rise, lam = u(0.002, 0.012), u(18, 60)
    kp = 2 / (rise * lam)
    law = dict(kind="pi", kp=kp, ki=kp / (4 * lam), u_min=-100.0, u_max=100.0)
    plant = dict(kind="transfer-function", num=[rise], den=[1.0, 0.0])
    return Family("level", 1.0, 11000, plant, law, dict(r="%", y="%", u="%"), span=18, centre=50, segment=850,
                  noise_sd=0.03, slow=120, wave_hz=0.004, lag=8, late=5, settle=15 * lam)


def pressure(rng):
    """The pressure of a vessel behind a line: two time constants and a zero."""
    u = rng.uniform
    gain, slow, quick, offset = u(0.04, 0.15), u(10, 25), u(1, 3), u(-10, 10)
    zero = u(0.2, 0.5) * slow
    kp = 0.6 * (slow + quick) / (gain * (0.4 * slow + zero))
    law = pid(rng, kp, kp / (slow + quick), 0.15 * kp * quick, 0.5, -50.0, 250.0)
    plant = dict(kind="transfer-function", num=[gain * zero, gain], den=[slow * quick, slow + quick, 1.0], offset=offset)
    return Family("pressure", 0.25, 12000, plant, law, dict(r="bar", y="bar", u="%"), span=30 * gain, centre=gain * (55 + offset), segment=140,
                  noise_sd=0.01 * gain, slow=35, wave_hz=0.025, lag=3, late=2.5, settle=15 * slow)


def two_lags(rng):
    """Two lags in a row, as of a jacket and what is inside it."""
    u = rng.uniform
    gain, slow, quick, offset = u(0.5, 2), u(8, 20), u(2, 6), u(0, 10)
    kp = (slow + quick) / (gain * (0.5 * slow + quick))
    law = pid(rng, kp, kp / (slow + quick), 0.5 * kp * quick, 0.4, -100.0, 200.0)
    plant = dict(kind="transfer-function", num=[gain], den=[slow * quick, slow + quick, 1.0], offset=offset)
    return Family("two-lags", 0.2, 13000, plant, law, dict(r="K", y="K", u="%"), span=28 * gain, centre=50 * gain, segment=150,
                  noise_sd=0.01 * gain, slow=40, wave_hz=0.03, lag=2.5, late=2, settle=15 * slow)


def oscillator(rng):
    """A lightly damped mode: a stage on a spring."""
    u = rng.uniform
    damping, rate, entry = u(0.1, 0.3), u(1.5, 3), u(0.7, 1.5)
    wc, gain = u(8, 16), rate * entry  # far above its own frequency the stage is a mass of 1/gain
    law = pid(rng, wc**2 / gain, 0.2 * wc**3 / gain, 1.6 * wc / gain, 0.008, -1e4, 1e4, also_pi=False)
    plant = dict(kind="state-space", a=[[-damping, rate], [-rate, -damping]], b=[[0.0], [entry]], c=[[1.0, 0.0]], d=[[0.0]])
    return Family("oscillator", 2e-3, 14000, plant, law, dict(r="1", y="1", u="1"), span=2.5, centre=0.1, segment=1.6,
                  noise_sd=5e-5, slow=0.5, wave_hz=0.5, lag=0.015, late=0.008, settle=60 / wc)


def tank(rng):
    """A tank that drains by its own head: slightly nonlinear."""
    u = rng.uniform
    area, inflow, height = u(8, 25), u(0.02, 0.06), u(0.8, 1.6)
    outflow = inflow * u(40, 60) / np.sqrt(height)
    slow = 2 * area * np.sqrt(height) / outflow
    lam = 0.4 * slow
    kp = area / (inflow * lam)
    law = dict(kind="pi", kp=kp, ki=kp / min(slow, 4 * lam), u_min=0.0, u_max=150.0)
    plant = dict(kind="tank", area=area, inflow_gain=inflow, outflow=outflow)
    return Family("tank", 0.5, 12000, plant, law, dict(r="m", y="m", u="%"), span=0.4 * height, centre=height, segment=180,
                  noise_sd=0.002 * height, slow=30, wave_hz=0.02, lag=2.5, late=2, settle=10 * slow, fixed=("inflow_gain",))


FAMILIES = {f.__name__.replace("_", "-"): f for f in (axis, arm, motor, heater, flow, level, pressure, two_lags, oscillator, tank)}
