"""drift finds what a feedback loop hides.

A loop that works looks healthy: the controller makes up for friction, leaks and drifting sensors until it can't. drift reads
what the loop pays for that off its own signals: the reference ``r``, the measured ``y`` and the controller's output ``u``.

* `Recording`, `look`: what was recorded. `Loop`, `init`: what is known of the loop.
* `simulate`: the sampled loop with hidden faults.
* `calibrate`, `Baseline`, `Monitor`, `monitor`: what healthy looks like, and telling drift from disturbance.
* `diagnose`: which physics a model left out, with numbers and a proof on unseen data.
* `design`: thresholds for a wanted time between false alarms.
* `drift.sql`: the monitor in the SQL of the package `datafusion`.

Wherever a recording is asked for, a `Recording`, a file's path, a pandas, polars or pyarrow table, or a mapping of columns
will do. Bad input raises `DriftError`, a `ValueError` of one line.
"""

from ._calibration import Baseline, Calibration, ChannelLine, calibrate
from ._decisions import Channel, Decision, Decisions
from ._design import Design, design
from ._diagnosis import Diagnosis, Finding, Number, diagnose
from ._drift import DriftError
from ._loop import Loop
from ._look import Overview, look
from ._monitoring import Event, Monitor, Monitoring, monitor
from ._plant import Plant, from_system, to_control, to_scipy
from ._proposal import Proposal, init
from ._recording import Recording
from ._result import Answer, KeyNumber
from ._simulation import Simulation, simulate

__all__ = [
    "Answer",
    "Baseline",
    "Calibration",
    "Channel",
    "ChannelLine",
    "Decision",
    "Decisions",
    "Design",
    "Diagnosis",
    "DriftError",
    "Event",
    "Finding",
    "KeyNumber",
    "Loop",
    "Monitor",
    "Monitoring",
    "Number",
    "Overview",
    "Plant",
    "Proposal",
    "Recording",
    "Simulation",
    "calibrate",
    "design",
    "diagnose",
    "from_system",
    "init",
    "look",
    "monitor",
    "simulate",
    "to_control",
    "to_scipy",
]
