"""From fitted models to python-control transfer functions and their step responses.

Like the files that end in ``_design``, it imports python-control, which takes about a second.
"""

# python-control carries no types: its objects are Any at this file's boundary.
# pyright: reportMissingTypeStubs=false

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import control
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.inference.record_checks import finite_samples, uniform_interval
from pamsim.linear.arx import ArxModel, PoleStatus, lag, time_constants_from_arx
from pamsim.linear.continuous_result import ContinuousFit
from pamsim.linear.discrete_result import DiscreteFit
from pamsim.linear.output_error import StepFit

FloatArray = NDArray[np.float64]
_control: Any = control


def continuous(model: StepFit | ArxModel | ContinuousFit, *, pade_order: int | None = None) -> Any:
    """Return the continuous transfer function of a fitted model.

    Args:
        model: an output-error fit of a step or of general inputs, or an ARX model whose poles are
            those of one or two lags.
        pade_order: order of the Pade approximation of a dead time; needed only if there is one.

    Returns:
        A continuous ``control.TransferFunction``.

    Raises:
        InputError: the ARX poles have no real time constants, or a dead time comes without
            ``pade_order``.

    Source: Matiskova 2021, equation (24).
    """
    dead_time = 0.0
    if isinstance(model, ContinuousFit):
        numerator, denominator = np.array(model.numerator), np.array(model.denominator)
        dead_time = model.dead_time
    elif isinstance(model, StepFit):
        numerator, denominator = np.array([model.gain]), _lags(model.time_constants)
        dead_time = model.dead_time
    else:
        chain = time_constants_from_arx(model)
        if chain.status is not PoleStatus.LAGS or chain.gain is None:
            raise InputError(
                f"ARX has no continuous G1 or G2: {chain.sentence}; "
                "use discrete(model) or fit by output error"
            )
        numerator, denominator = np.array([chain.gain]), _lags(chain.time_constants)
    result = _control.TransferFunction(numerator, denominator)
    if dead_time == 0.0:
        return result
    if pade_order is None or pade_order < 1:
        raise InputError(
            f"model has a dead time of {dead_time:g} s, which no transfer function holds exactly; "
            "give pade_order >= 1 (3 is usual)"
        )
    return result * _control.TransferFunction(*_control.pade(dead_time, pade_order))


def _lags(constants: Sequence[float]) -> FloatArray:
    denominator = np.array([1.0])
    for constant in constants:
        denominator = np.convolve(denominator, [constant, 1.0])
    return denominator


def discrete(model: ArxModel | DiscreteFit) -> Any:
    """Return ``B(z) / A(z)`` of a discrete model with its sample time.

    Args:
        model: ARX model, or ARX or output-error fit, of any order.

    Returns:
        A discrete ``control.TransferFunction`` with ``dt`` = Ts [s].

    Source: Matiskova 2021, equation (25), z-transformed.
    """
    if isinstance(model, DiscreteFit):
        model = model.model
    reach = lag(len(model.a), len(model.b), model.delay)
    numerator = np.zeros(reach + 1)
    numerator[model.delay : model.delay + len(model.b)] = model.b
    denominator = np.zeros(reach + 1)
    denominator[: len(model.a) + 1] = [1.0, *model.a]
    return _control.TransferFunction(numerator, denominator, model.sample_time)


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
