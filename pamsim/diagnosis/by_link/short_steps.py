"""What shorter time steps than those of a search show of a fitted model.

Fits take their sensitivities from long steps, which may hide what is as short as they are: a lag of
4 ms changed next to nothing in steps of 5 ms.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pamsim.comparison.chain_runs import MIDDLE
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.link_fit import LinkFitter
from pamsim.diagnosis.by_link.link_model import LinkModel


def sharpened(fitter: LinkFitter, model: LinkModel) -> LinkModel:
    """A model with the sensitivities of the time steps that its fit has ended in."""
    names = list(model.sensitivities)
    sets, steps = fitter.moved(model, names)
    base, *moved = fitter.in_steps(model, [model.values, *sets], fitter.short)
    if base is None:
        return model
    found = {
        name: model.sensitivities[name] if r is None else fitter.whiten(r - base) / step
        for name, step, r in zip(names, steps, moved, strict=True)
    }
    return replace(model, sensitivities=found)


def of_time_steps(fitter: LinkFitter, model: LinkModel) -> FloatArray:
    """Change of a model's rows (f,) if these time steps went to zero, to first order."""
    longer, shorter = (fitter.in_steps(model, [model.values], n)[0] for n in (MIDDLE, 1))
    if longer is None or shorter is None:
        return np.zeros_like(model.rows)
    return fitter.short * fitter.whiten(shorter - longer)
