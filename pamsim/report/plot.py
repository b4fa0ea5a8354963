"""One figure for a result, where a picture is the answer."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from pamsim.calibration.result import Calibration
from pamsim.core.errors import InputError
from pamsim.core.recording import Recording
from pamsim.report.calibrate_numbers import parameter_ranges
from pamsim.report.calibrate_signals import trial_signals
from pamsim.report.step_figure import step_figure


def plot(result: Any) -> Figure:
    """Draw a result.

    Args:
        result: a `Recording`; a `Calibration`, drawn against its trials, or as its parameters
            in their ranges where it has none.

    Returns:
        A matplotlib figure; ``figure.savefig(path)`` writes it.

    Raises:
        InputError: if there is no picture of such a result.
    """
    if isinstance(result, Recording):
        return step_figure(result)
    if isinstance(result, Calibration):
        trials = [c for c in result.comparisons if c.table is None]
        if trials:
            return trial_signals(trials)
        return parameter_ranges(result.to_dict()["parameters"])
    raise InputError(f"no picture of a {type(result).__name__}; give a result of pamsim")
