"""Test whether a nonlinearity explains part of the residuals of a linear model.

The squares and cubes of the input and of the model's output, unfiltered and through the model, are
what a weak static nonlinearity before, behind or within the dynamics adds to the output.
Source: Ramsey's test of specification (Journal of the Royal Statistical Society B 31, 1969), with
the filtered powers of a second- and third-order Volterra series.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.identified_model import IdentifiedModel
from pamsim.linear.residual_independence import RegressorTest, added_regressors
from pamsim.linear.signal_record import SignalRecord

_LEVEL = 0.01
_POWERS = (2, 3)


def residual_nonlinearity(fit: IdentifiedModel, records: Sequence[SignalRecord]) -> RegressorTest:
    """Test whether powers of inputs and output, or products of inputs, explain the residuals.

    Args:
        fit: a continuous model.
        records: the trials it was fitted to.

    Raises:
        InputError: too few samples.
    """
    return added_regressors(fit, records, [_powers(fit, record) for record in records])


def _powers(fit: IdentifiedModel, record: SignalRecord) -> FloatArray:
    """Powers of a trial's inputs and output, and products of inputs: ``(N, 6)`` of one input.

    Each unfiltered and through the model, powers of the output through the model alone.
    """
    structure = fit.structure
    assert isinstance(structure, ContinuousStructure)
    channels = fit.channels

    def through_model(values: FloatArray, given: int) -> FloatArray:
        alone, x = channels[given].structure, channels[given].coordinates
        assert isinstance(alone, ContinuousStructure)
        numerator = x[alone.coefficients()]
        units, hold = (record.units_input[given],), (record.holds[given],)
        filtered = replace(record, inputs=values, units_input=units, holds=hold, held_out=True)
        return alone.responses(x, filtered)[:, : numerator.size] @ numerator

    run = _standardised(fit.simulate(record))
    moving = [i for i in range(structure.inputs) if np.ptp(record.inputs[:, i]) > 0.0]
    inputs = {i: _standardised(record.inputs[:, i]) for i in moving}
    columns: list[FloatArray] = []
    for power in _POWERS:
        columns += [*(through_model(run**power, i) for i in moving), run**power]
    for i, given in inputs.items():
        for power in _POWERS:
            columns.append(through_model(given**power, i))
    for i, j in combinations(inputs, 2):
        product = inputs[i] * inputs[j]
        columns += [product, through_model(product, i), through_model(product, j)]
    return np.column_stack(columns)


def _standardised(values: FloatArray) -> FloatArray:
    return (values - np.mean(values)) / np.std(values)


def what_is_missing(fit: IdentifiedModel, records: Sequence[SignalRecord], adequate: bool) -> str:
    """Describe what is missing in a model.

    Args:
        fit: a continuous model.
        records: the trials it was fitted to.
        adequate: whether past inputs explain nothing of its residuals.

    Returns:
        A sentence: a nonlinearity where that is shown, else linear dynamics if the model is not
        adequate; empty if nothing is missing.
    """
    try:
        test = residual_nonlinearity(fit, records)
    except InputError:
        return "" if adequate else "past inputs explain part of the residuals"
    if test.p_value < _LEVEL:
        return (
            "the plant is not linear: powers of input and output explain part of the residuals"
            f" ({test.shown}); no linear model describes these records completely"
        )
    if adequate:
        return ""
    return (
        "past inputs explain part of the residuals, powers of input and output do not"
        f" ({test.shown}): dynamics are missing that no fitted structure has, or another input acts"
    )
