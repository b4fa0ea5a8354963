"""Whether the best model leaves something of the trials that it was judged by."""

from __future__ import annotations

from pamsim.comparison.noise_floor import NoiseFloor
from pamsim.comparison.trial_residuals import TrialLayout
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.evidence import Improvement
from pamsim.diagnosis.method.lack_of_fit import LackOfFit, shared_by_repeats
from pamsim.diagnosis.method.trial_variation import TrialVariation, without_variation
from pamsim.diagnosis.method.verdict_thresholds import LACK_OF_FIT_LOSS, REMAINDER_ERRORS


def has_remainder(
    left: Improvement,
    lack: LackOfFit,
    layout: TrialLayout,
    residual: FloatArray,
    floor: NoiseFloor,
    variation: TrialVariation | None = None,
    *,
    least: float,
) -> bool:
    """Whether held-out losses exceed those of a perfect model by more than chance.

    Where the fitted trials leave nothing, repeats must share the excess as well. The noise floor
    comes from the same held-out trials: if by chance they vary the same way, their losses agree on
    an excess.

    Args:
        left: of a perfect model over the model.
        lack: of fit of the model.
        layout: of the residual.
        residual: (n,) of the model [SI].
        floor: of the noise.
        variation: from trial to trial; None where it is not known.
        least: loss over the noise variance from which an excess counts.
    """
    if left.gain <= max(REMAINDER_ERRORS * left.error, least):
        return False
    if layout.origin or not lack.testable or lack.size >= LACK_OF_FIT_LOSS:
        return True
    unseen = shared_by_repeats(without_variation(layout, residual, floor, variation))
    return unseen.significant or not unseen.testable
