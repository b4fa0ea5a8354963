"""From fitted models to python-control: transfer functions, state space, plants drawn from a fit.

It imports python-control, which takes about a second.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import control
import numpy as np
import scipy.linalg

from pamsim.core.errors import InputError
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.model import IdentifiedModel

_control: Any = control
_expm: Any = scipy.linalg.expm

_ROUNDING = 1e-9  # of a period, in a dead time of whole periods; of a pole's size, at the stability
_MOST_DRAWS = 100  # for each plant that is wanted


def continuous(model: IdentifiedModel, *, pade_order: int | None = None) -> Any:
    """Return the continuous transfer function of a fitted model: a row, a column per input.

    Args:
        model: a continuous model.
        pade_order: order of the Pade approximation of a dead time; needed only if there is one.

    Returns:
        A continuous ``control.TransferFunction``.

    Raises:
        InputError: the model is discrete, or a dead time comes without ``pade_order``.

    Source: Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equation (24).
    """
    if len(model.units_input) > 1:
        row = [continuous(one, pade_order=pade_order) for one in model.channels]
        above = [[one.num[0][0] for one in row]]
        below = [[one.den[0][0] for one in row]]
        return _control.TransferFunction(above, below)
    result = _rational(model)
    return result if model.dead_time == 0.0 else result * _pade(model.dead_time, pade_order)


def discrete(model: IdentifiedModel) -> Any:
    """Return ``B(z) / A(z)`` of a discrete model with its sample time.

    Args:
        model: an ARX or output-error model of any order.

    Returns:
        A discrete ``control.TransferFunction`` with ``dt`` = Ts [s].

    Raises:
        InputError: the model is continuous.

    Source: Matiskova 2021, equation (25), z-transformed.
    """
    structure = model.structure
    if not isinstance(structure, DiscreteStructure):
        raise InputError(f"{structure.sentence} is continuous; use continuous(model)")
    numerator, denominator = np.zeros((2, structure.reach + 1))
    numerator[structure.nk : structure.nk + structure.nb] = structure.numerator(model.coordinates)
    denominator[: structure.na + 1] = structure.denominator(model.coordinates)
    return _control.TransferFunction(numerator, denominator, structure.sample_time)


def state_space(model: IdentifiedModel, *, pade_order: int | None = None) -> Any:
    """Return a fitted model in state space: a continuous one as `continuous`, others `discrete`.

    Args:
        model: a continuous, ARX or output-error model.
        pade_order: as in `continuous`.

    Returns:
        A ``control.StateSpace``; the states have no meaning of their own.

    Raises:
        InputError: a dead time comes without ``pade_order``.
    """
    if isinstance(model.structure, DiscreteStructure):
        return _control.tf2ss(discrete(model))
    if len(model.units_input) == 1:
        return _control.tf2ss(continuous(model, pade_order=pade_order))
    delays = [one.dead_time for one in model.channels]
    if not any(delays):
        return _common_state_space(model)
    at_once = _control.ss([], [], [], [[1.0]])
    late = [_control.tf2ss(_pade(delay, pade_order)) if delay else at_once for delay in delays]
    return _common_state_space(model) * _control.append(*late)


def _common_state_space(model: IdentifiedModel) -> Any:
    """A model of several inputs without its dead times: one state per pole, in observer form."""
    channels = model.channels
    below = np.array(channels[0].denominator)
    order = below.size - 1
    above = np.zeros((len(channels), order + 1))
    for row, channel in zip(above, channels, strict=True):
        row[order + 1 - len(channel.numerator) :] = channel.numerator
    below, above = below / below[0], above / below[0]
    direct = above[:, :1]
    a = np.hstack([-below[1:, np.newaxis], np.eye(order, order - 1)]) if order else np.empty((0, 0))
    b = (above[:, 1:] - direct * below[1:]).T
    return _control.ss(a, b, np.eye(1, order), direct.T)


def _pade(delay: float, pade_order: int | None) -> Any:
    if pade_order is None or pade_order < 1:
        raise InputError(
            f"model has a dead time of {delay:g} s, which no transfer function represents exactly;"
            " give pade_order >= 1 (3 is usual)"
        )
    return _control.TransferFunction(*_control.pade(delay, pade_order))


def with_held_input(model: IdentifiedModel, period: float) -> Any:
    """Return a continuous model as a computer sees it that holds its only input between samples.

    The dead time, also of parts of a period, is exact.

    Args:
        model: a continuous model.
        period: between two samples [s].

    Returns:
        A discrete ``control.StateSpace`` with ``dt = period``.

    Raises:
        InputError: the model is discrete or has several inputs, or the period is not above 0.

    Source: Astrom and Wittenmark, Computer-Controlled Systems, 3rd edition, section 2.3.
    """
    if not 0.0 < period < np.inf:
        raise InputError(f"period = {period:g} s must be above 0")
    plant = _control.tf2ss(_rational(model))
    f, g, c, d = (np.asarray(part, np.float64) for part in (plant.A, plant.B, plant.C, plant.D))
    order = f.shape[0]
    whole = int((model.dead_time + _ROUNDING * period) // period)
    late = max(model.dead_time - whole * period, 0.0)
    late = late if late > _ROUNDING * period else 0.0
    driven = np.zeros((order + 1, order + 1))
    driven[:order] = np.hstack([f, g])
    newer, older = _expm(driven * (period - late)), _expm(driven * late)
    # The states, then the inputs of the last samples, latest first.
    delays = whole + (late > 0.0)
    a = np.zeros((order + delays, order + delays))
    b = np.zeros((order + delays, 1))
    a[:order, :order] = newer[:order, :order] @ older[:order, :order]
    for past, into in (
        (whole, newer[:order, order]),
        (delays, newer[:order, :order] @ older[:order, order]),
    ):
        target = b[:order, 0] if past == 0 else a[:order, order + past - 1]
        target += into
    output = np.hstack([c, np.zeros((1, delays))])
    if delays:
        b[order] = 1.0
        a[order + 1 :, order:-1] += np.eye(delays - 1)
        output[0, -1], d = d[0, 0], np.zeros((1, 1))
    return _control.ss(a, b, output, d, period)


def _rational(model: IdentifiedModel) -> Any:
    """A continuous model without its dead time."""
    if not isinstance(model.structure, ContinuousStructure):
        raise InputError(f"{model.structure.sentence} is discrete; use discrete(model)")
    return _control.TransferFunction(model.numerator, model.denominator)


def sampled_plants(
    fit: IdentifiedModel,
    count: int,
    rng: np.random.Generator,
    *,
    period: float | None = None,
    pade_order: int | None = None,
) -> list[Any]:
    """Draw plants that the data of a fit leave possible.

    The estimates are drawn from the normal distribution of the fit's coordinates: logarithms of
    time constants, of natural frequencies and of dampings, the dead time, the coefficients of the
    numerator. Continuous plants are stable by these coordinates. A dead time that is drawn below 0
    is 0. A draw with more or fewer unstable poles than the fit, as a discrete model may have, is
    drawn again: then the plants' covariance is smaller than that of the fit.

    Like the intervals, the spread is that of the noise. It does not hold what a linear model is
    missing: for that, compare fits at several operating points.

    Args:
        fit: of which the data determine all parameters.
        count: of plants.
        rng: random numbers.
        period: of a held input, see `with_held_input`; None for the model as it is.
        pade_order: as in `continuous`, of a continuous model with a dead time and no period.

    Returns:
        As many ``control.StateSpace``.

    Raises:
        InputError: for a fit without covariance, or if hardly any draw is as stable as the fit.
    """
    plants: list[Any] = []
    unstable = _unstable(fit)
    for drawn in _draws(fit, _MOST_DRAWS * count, rng):
        if len(plants) == count:
            break
        if _unstable(drawn) == unstable:
            plants.append(
                state_space(drawn, pade_order=pade_order)
                if period is None
                else with_held_input(drawn, period)
            )
    if len(plants) < count:
        raise InputError(
            f"only {len(plants)} of {_MOST_DRAWS * count} draws are as stable as the fit,"
            " because its poles are too uncertain; lower the order or record longer"
        )
    return plants


def _draws(fit: IdentifiedModel, most: int, rng: np.random.Generator) -> Iterator[IdentifiedModel]:
    """Models whose coordinates are normal about the fit's, with its covariance."""
    if fit.covariance is None:
        raise InputError(f"the fit has no covariance to draw from: {fit.sentence}")
    # In units of the standard errors: coordinates differ by many orders of magnitude.
    error = np.sqrt(np.diag(fit.covariance))
    scale = np.where(error > 0.0, error, 1.0)
    values, axes = np.linalg.eigh(fit.covariance / np.outer(scale, scale))
    spread = scale[:, np.newaxis] * axes * np.sqrt(np.maximum(values, 0.0))
    for _ in range(most):
        x = fit.coordinates + spread @ rng.standard_normal(error.size)
        if isinstance(fit.structure, ContinuousStructure) and fit.structure.dead_time:
            late = slice(fit.structure.order, fit.structure.searched)
            x[late] = np.maximum(x[late], 0.0)
        yield replace(fit, coordinates=x)


def _unstable(model: IdentifiedModel) -> int:
    poles = np.array(model.poles)
    if isinstance(model.structure, DiscreteStructure):
        return int(np.count_nonzero(np.abs(poles) > 1.0 + _ROUNDING))
    return int(np.count_nonzero(np.real(poles) > _ROUNDING * np.abs(poles)))
