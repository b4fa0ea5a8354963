"""From fitted models to python-control transfer functions and their step responses.

Like the files that end in ``_design``, it imports python-control, which takes about a second.
"""

# python-control carries no types: its objects are Any at this file's boundary.
# pyright: reportMissingTypeStubs=false

from __future__ import annotations

from typing import Any

import control
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import finite_samples, uniform_interval
from pamsim.linear.arx import ArxModel, PoleStatus, lag, time_constants_from_arx
from pamsim.linear.continuous_structure import ContinuousStructure
from pamsim.linear.discrete_structure import DiscreteStructure
from pamsim.linear.identified_model import IdentifiedModel

FloatArray = NDArray[np.float64]
_control: Any = control


def continuous(model: IdentifiedModel | ArxModel, *, pade_order: int | None = None) -> Any:
    """Return the continuous transfer function of a fitted model.

    Args:
        model: a continuous model, or an ARX model whose poles are those of one or two lags.
        pade_order: order of the Pade approximation of a dead time; needed only if there is one.

    Returns:
        A continuous ``control.TransferFunction``.

    Raises:
        InputError: the ARX poles have no real time constants, the model is discrete, or a dead
            time comes without ``pade_order``.

    Source: Matiskova 2021 (Appl. Sci. 2021, 11, 7288), equation (24).
    """
    if isinstance(model, ArxModel):
        chain = time_constants_from_arx(model)
        if chain.status is not PoleStatus.LAGS or chain.gain is None:
            raise InputError(
                f"ARX has no continuous G1 or G2: {chain.sentence}; "
                "use discrete(model) or fit by output error"
            )
        denominator = np.array([1.0])
        for constant in chain.time_constants:
            denominator = np.convolve(denominator, [constant, 1.0])
        return _control.TransferFunction([chain.gain], denominator)
    if not isinstance(model.structure, ContinuousStructure):
        raise InputError(f"{model.structure.sentence} is discrete; use discrete(model)")
    result = _control.TransferFunction(model.numerator, model.denominator)
    if model.dead_time == 0.0:
        return result
    if pade_order is None or pade_order < 1:
        raise InputError(
            f"model has a dead time of {model.dead_time:g} s, which no transfer function represents"
            " exactly; give pade_order >= 1 (3 is usual)"
        )
    return result * _control.TransferFunction(*_control.pade(model.dead_time, pade_order))


def discrete(model: IdentifiedModel | ArxModel) -> Any:
    """Return ``B(z) / A(z)`` of a discrete model with its sample time.

    Args:
        model: an ARX model, or a discrete identified model, of any order.

    Returns:
        A discrete ``control.TransferFunction`` with ``dt`` = Ts [s].

    Raises:
        InputError: the model is continuous.

    Source: Matiskova 2021, equation (25), z-transformed.
    """
    if isinstance(model, ArxModel):
        below, above, nk, interval = (1.0, *model.a), model.b, model.delay, model.sample_time
    elif isinstance(model.structure, DiscreteStructure):
        below, above = model.denominator, model.numerator
        nk, interval = model.structure.nk, model.structure.sample_time
    else:
        raise InputError(f"{model.structure.sentence} is continuous; use continuous(model)")
    reach = lag(len(below) - 1, len(above), nk)
    numerator, denominator = np.zeros(reach + 1), np.zeros(reach + 1)
    numerator[nk : nk + len(above)] = above
    denominator[: len(below)] = below
    return _control.TransferFunction(numerator, denominator, interval)


def step_response(transfer_function: Any, time: ArrayLike) -> FloatArray:
    """Return the unit-step response of a transfer function by python-control.

    Args:
        transfer_function: continuous or discrete ``control.TransferFunction``, one input, one
            output.
        time: uniform times that start at 0, shape ``(n,)``; of a discrete one, its samples [s].

    Returns:
        The response, shape ``(n,)`` [output unit].

    Raises:
        InputError: time does not start at 0, is not uniform and increasing, or its interval is not
            the sample time of a discrete transfer function.
    """
    t = finite_samples(time, "time")
    if t.size < 2 or t[0] != 0.0 or np.any(np.diff(t) <= 0.0):
        raise InputError("time must start at 0 and increase over at least 2 samples; shift it")
    interval = uniform_interval(t)
    if transfer_function.isdtime(strict=True):
        own = float(transfer_function.dt)
        if abs(interval - own) > 1e-6 * own:
            raise InputError(
                f"time has interval {interval:g} s but the transfer function is sampled at "
                f"{own:g} s; use its own sample times"
            )
        # Times with the rounding of a written file would be refused by python-control.
        t = np.arange(t.size) * own
    result: Any = _control.step_response(transfer_function, T=t, squeeze=True)
    return np.asarray(result.outputs, dtype=np.float64)
