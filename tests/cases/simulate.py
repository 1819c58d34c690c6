"""The closed loop: a Runge-Kutta integration of fourth order over the pieces of a sample in which the drive is smooth.

Independent of drift-sim, which takes exact exponential steps or four mid-point sub-steps. A dead time cuts the sample where the
drive changes; where dry friction stops the mass, the moment is found by bisection and the mass stays until the force exceeds
what holds it. check.py compares with scipy's adaptive integrator.
"""
import numba as nb
import numpy as np

from kinds import INDEX, ONSET

SERVO, LINEAR, TANK = range(3)
PI, PID, P_VELOCITY = range(3)
# The state: the plant's own in 0..3 (a servo: position, speed), then the lag, the flexible mode (place, speed) and the slow sensor.
LAG, MODE, SENSOR, STATES = 4, 5, 7, 8
BISECTIONS = 40

(COULOMB, STRIBECK, DIRECTIONAL, LOAD_DEPENDENT, DRAG, VISCOUS, INERTIA, COGGING, STIFFNESS, GRAVITY, RADIATION, LEAK, INJECTED, SATURATION,
 DEAD_ZONE, BACKLASH, STICTION, GAIN_LOSS, NONLINEAR, DELAY, RATE, LAGGING, FLEXIBLE, HYSTERESIS, SLOW_SENSOR, NOISE, BIAS, DRIFT, ROUNDING,
 LOAD_STEP, LOAD_RAMP, PERIODIC, LAW_GAIN, LAW_DELAY) = range(len(INDEX))


@nb.njit(cache=True)
def friction(e, on, direction, speed, transmitted):
    """Dry friction that is there against motion in this direction."""
    out = 0.0
    if on[COULOMB]:
        out += e[COULOMB, 0]
    if on[STRIBECK]:
        out += e[STRIBECK, 0] + (e[STRIBECK, 1] - e[STRIBECK, 0]) * np.exp(-((speed / e[STRIBECK, 2]) ** 2))
    if on[DIRECTIONAL]:
        out += e[DIRECTIONAL, 0] if direction > 0 else e[DIRECTIONAL, 1]
    if on[LOAD_DEPENDENT]:
        out += e[LOAD_DEPENDENT, 0] * abs(transmitted)
    return out


@nb.njit(cache=True)
def outer_force(e, on, position, speed):
    """Forces on a mass that depend on where it is and how it moves, but for the plant's own viscous friction."""
    out = 0.0
    if on[COGGING]:
        out -= e[COGGING, 0] * np.sin(2 * np.pi * position / e[COGGING, 1] + e[COGGING, 2])
    if on[STIFFNESS]:
        out -= e[STIFFNESS, 0] * position
    if on[GRAVITY]:
        out -= e[GRAVITY, 0] * np.sin(position + e[GRAVITY, 1])
    if on[DRAG]:
        out -= e[DRAG, 0] * speed * abs(speed)
    if on[DIRECTIONAL]:
        out -= (e[DIRECTIONAL, 2] if speed > 0 else e[DIRECTIONAL, 3]) * speed
    return out


@nb.njit(cache=True)
def disturbance(e, on, t, load, rate, since):
    """What is subtracted from the drive: the process noise (a straight line since the sample) and the loads that are terms."""
    out = load + rate * since
    if on[LOAD_STEP]:
        out += e[LOAD_STEP, 0]
    if on[LOAD_RAMP]:
        out += e[LOAD_RAMP, 0] * (t - max(e[LOAD_RAMP, ONSET], 0.0))
    if on[PERIODIC]:
        out += e[PERIODIC, 0] * np.sin(2 * np.pi * e[PERIODIC, 1] * t)
    return out


@nb.njit(cache=True)
def forces(model, number, e, on, z, reaches, load):
    """(force of the actuator, all other forces but dry and viscous friction) on a servo's mass."""
    return number[2] * reaches, outer_force(e, on, z[0], z[1]) - load


@nb.njit(cache=True)
def passed(e, on, z, acts):
    """What reaches the plant, of what leaves the actuator: behind the lag and the flexible mode."""
    out = z[LAG] if on[LAGGING] else acts
    return z[MODE] if on[FLEXIBLE] else out


@nb.njit(cache=True)
def output(model, number, c, z):
    if model == SERVO:
        return z[0] if number[3] == 0 else z[1]
    if model == TANK:
        return z[0]
    return c[0] * z[0] + c[1] * z[1] + c[2] * z[2] + c[3] * z[3]


@nb.njit(cache=True)
def slope(dz, model, number, a, b, c, e, on, z, acts, load, direction):
    """dz/dt; `direction` is that of a sliding mass, 0 where it is held."""
    behind = z[LAG] if on[LAGGING] else acts
    dz[LAG] = (acts - z[LAG]) / e[LAGGING, 0] if on[LAGGING] else 0.0
    if on[FLEXIBLE]:
        w = 2 * np.pi * e[FLEXIBLE, 0]
        dz[MODE] = z[MODE + 1]
        dz[MODE + 1] = w * w * (behind - z[MODE]) - 2 * e[FLEXIBLE, 1] * w * z[MODE + 1]
    else:
        dz[MODE] = dz[MODE + 1] = 0.0
    reaches = passed(e, on, z, acts)
    if model == SERVO:
        inertia = number[0] * (e[INERTIA, 0] if on[INERTIA] else 1.0)
        viscous = number[1] * (e[VISCOUS, 0] if on[VISCOUS] else 1.0)
        actuator, outside = forces(model, number, e, on, z, reaches, load)
        dry = friction(e, on, direction, abs(z[1]), 0.5 * (actuator - outside))
        dz[0] = z[1]
        dz[1] = 0.0 if direction == 0 else (actuator + outside - direction * dry - viscous * z[1]) / inertia
    elif model == LINEAR:
        y = output(model, number, c, z)
        drive = number[0] * reaches + number[1] - load
        if on[LEAK]:
            drive -= e[LEAK, 0] * y
        if on[RADIATION]:
            drive -= e[RADIATION, 0] * ((y + 273.15) ** 4 - (number[1] + 273.15) ** 4)
        for i in range(4):
            dz[i] = b[i] * drive
            for j in range(4):
                dz[i] += a[i, j] * z[j]
    else:
        drive = number[1] * reaches - load - (e[LEAK, 0] * z[0] if on[LEAK] else 0.0)
        dz[0] = (drive - number[2] * np.sqrt(max(z[0], 0.0))) / number[0]
        if z[0] <= 0:
            dz[0] = max(dz[0], 0.0)
    dz[SENSOR] = (output(model, number, c, z) - z[SENSOR]) / e[SLOW_SENSOR, 0] if on[SLOW_SENSOR] else 0.0


@nb.njit(cache=True)
def follow(start, target, most, since):
    """A straight way from start to target at a rate of at most `most`."""
    way = most * since
    return start + min(max(target - start, -way), way)


@nb.njit(cache=True)
def step(z, new, k, h, t, since, held, target, most, load, rate, model, number, a, b, c, e, on, direction):
    """One step of Runge and Kutta from z to new; `since` is the time since the sample."""
    for stage in range(4):
        part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        for i in range(STATES):
            new[i] = z[i] + (part * h * k[stage - 1, i] if stage else 0.0)
        at = part * h
        acts = follow(held, target, most, at) if most > 0 else target
        slope(k[stage], model, number, a, b, c, e, on, new, acts, disturbance(e, on, t + at, load, rate, since + at), direction)
    for i in range(STATES):
        new[i] = z[i] + h / 6 * (k[0, i] + 2 * k[1, i] + 2 * k[2, i] + k[3, i])


@nb.njit(cache=True)
def advance(z, new, k, length, steps, t, since, target, most, held, load, rate, model, number, a, b, c, e, on):
    """The state after a piece of a sample over which the drive is smooth; gives what leaves the actuator at its end."""
    dry = model == SERVO and (on[COULOMB] or on[STRIBECK] or on[DIRECTIONAL] or on[LOAD_DEPENDENT])
    for s in range(steps):
        left = length / steps
        for _ in range(4):  # to a stop, on from rest, and the end
            direction = 1.0
            if dry:
                direction = np.sign(z[1])
                if z[1] == 0:
                    acts = follow(held, target, most, 0.0) if most > 0 else target
                    actuator, outside = forces(model, number, e, on, z, passed(e, on, z, acts), disturbance(e, on, t, load, rate, since))
                    net = actuator + outside
                    if abs(net) > friction(e, on, np.sign(net), 0.0, 0.5 * (actuator - outside)):
                        direction = np.sign(net)
            h = left
            step(z, new, k, h, t, since, held, target, most, load, rate, model, number, a, b, c, e, on, direction)
            stops = dry and direction != 0 and new[1] * direction < 0
            if stops and z[1] == 0:  # pushed off and back at once: it stays
                direction = 0.0
                step(z, new, k, h, t, since, held, target, most, load, rate, model, number, a, b, c, e, on, direction)
                stops = False
            if stops:
                low, high = 0.0, left
                for _ in range(BISECTIONS):
                    h = 0.5 * (low + high)
                    step(z, new, k, h, t, since, held, target, most, load, rate, model, number, a, b, c, e, on, direction)
                    if new[1] * direction < 0:
                        high = h
                    else:
                        low = h
                new[1] = 0.0
            z[:] = new
            held = follow(held, target, most, h) if most > 0 else target
            t += h
            since += h
            left -= h
            if left <= 0 or not stops:
                break
    return held


@nb.njit(cache=True)
def run(r, sample_time, steps, before, model, number, a, b, c, delay, law, e, spans, noise, noise_sd, lattice, load, load_end, z, integrator, seed):
    """(y, u, true y) of all samples; the first `before` of them lie before the recording.

    `number`: servo: inertia, viscous, gain, 1 if y is the speed; linear: gain of u, offset of the drive; tank: area, inflow, outflow.
    `law`: kind, kp, ki or kv, kd, filter, u_min, u_max. `noise`: of unit deviation. `load`, `load_end`: the process noise at the
    sample and just before the next. `lattice`: what the sensor rounds to anyway; 0: nothing.
    """
    np.random.seed(seed)
    count = len(r)
    ys, us, ts = np.empty(count), np.empty(count), np.empty(count)
    new, k = np.empty(STATES), np.empty((4, STATES))
    on = np.zeros(len(e), np.bool_)
    true_y = output(model, number, c, z)
    shown = m_before = true_y
    derivative = 0.0
    stem = play = held = z[LAG]
    waits = np.full(4000, z[LAG])
    commands = np.full(4000, z[LAG])
    started = False
    for n in range(count):
        t = (n - before) * sample_time
        for i in range(len(e)):
            on[i] = t >= e[i, ONSET] - 1e-9 * sample_time
        if n == before and model == SERVO and number[3] == 1:
            z[0] = 0.0  # where y is a speed, the position counts from the start of the recording
        true_y = output(model, number, c, z)
        m = true_y
        if on[HYSTERESIS]:
            half = 0.5 * e[HYSTERESIS, 0]
            shown = min(max(shown, m - half), m + half)
            m = shown
        else:
            shown = m
        if on[SLOW_SENSOR]:
            m = z[SENSOR]
        else:
            z[SENSOR] = m
        m += noise_sd * noise[n] * (e[NOISE, 0] if on[NOISE] else 1.0)
        if on[BIAS]:
            m += e[BIAS, 0]
        if on[DRIFT]:
            age = t - max(e[DRIFT, ONSET], 0.0)
            m += e[DRIFT, 0] * age + e[DRIFT, 1] * age * np.random.normal()
        if on[ROUNDING]:
            m = np.round(m / e[ROUNDING, 0]) * e[ROUNDING, 0]
        elif lattice > 0:
            m = np.round(m / lattice) * lattice
        ratio = e[LAW_GAIN, 0] if on[LAW_GAIN] else 1.0
        error = r[n] - m
        if n == 0:
            m_before = m
        if law[0] == P_VELOCITY:
            v = ratio * law[2] * (law[1] * error - (m - m_before) / sample_time)
        else:
            if law[0] == PID:
                derivative = (law[4] * derivative - ratio * law[3] * (m - m_before)) / (law[4] + sample_time)
            rest = ratio * law[1] * error + derivative
            change = ratio * law[2] * sample_time * error
            v = rest + integrator + change
            if (v > law[6] and change > 0) or (v < law[5] and change < 0):
                v = rest + integrator
            else:
                integrator += change
        m_before = m
        v = min(max(v, law[5]), law[6])
        commands[n % 4000] = v
        if on[LAW_DELAY]:
            late = e[LAW_DELAY, 0] / sample_time
            whole = int(late)
            newer = commands[(n - whole) % 4000] if n >= whole else commands[0]
            older = commands[(n - whole - 1) % 4000] if n > whole else commands[0]
            v = newer + (late - whole) * (older - newer)
        ys[n], us[n], ts[n] = m, v, true_y
        w = v
        if on[INJECTED]:
            for i in range(len(spans)):
                if spans[i, 0] <= t + 1e-9 * sample_time and t + 1e-9 * sample_time < spans[i, 1]:
                    w += e[INJECTED, 0]
        if on[SATURATION]:
            w = min(max(w, e[SATURATION, 0]), e[SATURATION, 1])
        if on[DEAD_ZONE]:
            w = np.sign(w) * max(abs(w) - e[DEAD_ZONE, 0], 0.0)
        if not started:
            play = stem = held = w
            waits[:] = w
            if on[LAGGING]:
                z[LAG] = w
            z[MODE] = w
            started = True
        if on[BACKLASH]:
            half = 0.5 * e[BACKLASH, 0]
            play = min(max(play, w - half), w + half)
            w = play
        else:
            play = w
        if on[STICTION]:
            off = w - stem
            if abs(off) > e[STICTION, 0]:
                stem = w - np.sign(off) * (e[STICTION, 0] - e[STICTION, 1])
            w = stem
        else:
            stem = w
        if on[GAIN_LOSS]:
            w *= 1 - e[GAIN_LOSS, 0]
        if on[NONLINEAR]:
            w = np.sign(w) * abs(w) ** e[NONLINEAR, 0]
        waits[n % 4000] = w
        late = (delay + (e[DELAY, 0] if on[DELAY] else 0.0)) / sample_time
        whole = int(late + 1e-12)
        part = max(late - whole, 0.0)
        newer = waits[(n - whole) % 4000] if n >= whole else waits[0]
        older = waits[(n - whole - 1) % 4000] if n > whole else waits[0]
        most = e[RATE, 0] if on[RATE] else 0.0
        if not on[LAGGING]:
            z[LAG] = held
        if not on[FLEXIBLE]:
            z[MODE], z[MODE + 1] = held, 0.0
        rate = (load_end[n] - load[n]) / sample_time
        cut = part * sample_time
        if part > 1e-9:
            held = advance(z, new, k, cut, max(int(np.ceil(part * steps)), 1), t, 0.0, older, most, held, load[n], rate, model, number, a, b, c, e, on)
        held = advance(z, new, k, sample_time - cut, max(int(np.ceil((1 - part) * steps)), 1), t + cut, cut, newer, most, held, load[n], rate, model,
                       number, a, b, c, e, on)
    return ys, us, ts
