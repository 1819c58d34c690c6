"""Ctrl-C is heard while Rust computes, and the work ends."""

import os
import signal
import threading
import time

import pytest

import drift


@pytest.fixture(autouse=True)
def hears_ctrl_c():
    """A shell starts what runs in its background deaf to Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_ends_a_diagnosis(oven):
    # Long enough to take far more than what the test waits for.
    run = drift.simulate(oven, duration_s=500_000, reference_mean=35.0, reference_sd=3.0, reference_hold=200)
    recording = run.to_recording()
    pressed = []

    def press():
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.5, press)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        drift.diagnose(recording, oven)
    assert time.monotonic() - pressed[0] < 2.0
    timer.join()
    # The work ends by itself: the process comes to rest.
    for _ in range(120):
        before = time.process_time()
        time.sleep(0.5)
        if time.process_time() - before < 0.1:
            return
    pytest.fail("the diagnosis goes on although nobody waits for it")


def test_nothing_is_left_behind_by_it(oven):
    run = drift.simulate(oven, duration_s=10_000, reference_mean=35.0, reference_sd=3.0, reference_hold=200)
    assert drift.diagnose(run.to_recording(), oven).verdict == "no_mismatch"
