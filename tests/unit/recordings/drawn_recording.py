"""A recording of random signals."""

from __future__ import annotations

import numpy as np

from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.signals import SignalNames


def drawn_recording(names: SignalNames, kind: str = "valve", seed: int = 5) -> Recording:
    """30 samples, every 4 ms, of all that a rig records."""
    draw = np.random.default_rng(seed)
    n, m, j = 30, len(names.muscles), len(names.joints)
    top = 4e5 if kind == "pressure_set" else 1.0
    return Recording(
        time=np.arange(n) * 0.004,
        joints=names.joints,
        positions=draw.uniform(-0.3, 0.3, (n, j)),
        velocities=np.zeros((n, j)),
        pressure=draw.uniform(1e5, 4e5, (n, m)),
        tension=draw.uniform(0.0, 900.0, (n, m)),
        command=draw.uniform(0.5 * top, top, (n, m)),
        drive=kind,
        load=1.2345678,
        muscles=names.muscles,
        outcome=Outcome.COMPLETED,
        message="",
        final_state=np.zeros(1),
    )
