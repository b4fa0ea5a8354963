"""One figure for a result, where a picture is the answer."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from pamsim.core.errors import InputError
from pamsim.core.recording import Recording
from pamsim.report.step_figure import step_figure


def plot(result: Any) -> Figure:
    """Draw a result.

    Args:
        result: a `Recording`.

    Returns:
        A matplotlib figure; ``figure.savefig(path)`` writes it.

    Raises:
        InputError: if there is no picture of such a result.
    """
    if isinstance(result, Recording):
        return step_figure(result)
    raise InputError(f"no picture of a {type(result).__name__}; give a result of pamsim")
