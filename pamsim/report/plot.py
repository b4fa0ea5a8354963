"""One figure for a result, where a picture is the answer."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from pamsim.core.errors import InputError
from pamsim.recordings.recording import Recording
from pamsim.report.calibrate_page import parameter_ranges
from pamsim.report.check_page import AS_IT_IS
from pamsim.report.fit_figure import fit_figure
from pamsim.report.identify_page import measured_and_fitted_response, measured_and_model
from pamsim.report.link_page import first_figure
from pamsim.report.reproduce_figures import static_characteristic
from pamsim.report.step_figure import step_figure
from pamsim.report.sweep_figure import sweep_figure
from pamsim.report.trial_signals import trial_signals


def plot(result: Any) -> Figure:
    """Draw a result.

    Args:
        result: what `pamsim.simulate`, `identify`, `fit`, `check`, `calibrate`, `diagnose`,
            `sweep` or `reproduce` returns.

    Returns:
        A recording: angle, pressures and tensions over time. An identification: measured output and
        models; of a frequency response magnitude and phase. A fit: data, fitted curves and
        residuals. A check: its trials beside the rig. A calibration: its trials before and after,
        or its parameters in their ranges where it has no trials. A diagnosis: held-out error of
        every link before and after; for a table its rows, for a loop its branches. A sweep: outputs
        over factors. A reproduction: printed and simulated angles at rest.
        ``figure.savefig(path)`` writes it.

    Raises:
        InputError: if there is no picture of such a result.
    """
    if isinstance(result, Recording):
        return step_figure(result)
    content = result.to_dict() if hasattr(result, "to_dict") else {}
    match str(content.get("schema")).partition("/")[0]:
        case "pamsim-identify":
            return measured_and_model(content, result.curves())
        case "pamsim-identify-frequency":
            return measured_and_fitted_response(result)
        case "pamsim-fit":
            return fit_figure(content)
        case "pamsim-check":
            return trial_signals(result.comparisons, AS_IT_IS)
        case "pamsim-calibrate":
            trials = [c for c in result.comparisons if c.table is None]
            return trial_signals(trials) if trials else parameter_ranges(content["parameters"])
        case "pamsim-diagnosis":
            return first_figure(content)[1]
        case "pamsim-sweep-result":
            return sweep_figure(result)
        case "pamsim-reproduce":
            distinct = [row for row in content["rows"] if row["repeats"] is None]
            return static_characteristic(distinct, content["figure6"])
        case _:
            raise InputError(
                f"no picture of a {type(result).__name__}; help(pamsim.plot) lists what has one"
            )
