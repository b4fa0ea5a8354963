"""A trial made of arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from pamsim.recordings.trial import Trial


def made_trial(command: Any, measured: Any = None, **changes: Any) -> Trial:
    """A trial at 100 Hz of set points for two muscles, but for what the caller changes."""
    given = {
        "name": "one",
        "protocol": "one",
        "drive": "pressure_set",
        "load": 0.0,
        "time": np.arange(len(command)) / 100.0,
    }
    return Trial(**(given | {"command": command, "measured": measured or {}} | changes))
