"""A python-control controller as plain numbers, sampled: ``x+ = A x + B e``, ``u = C x + D e``.

Controllers themselves know nothing of python-control: `pamsim.controllers.model_based.Lti` runs
these numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import control
import numpy as np

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray

_control: Any = control  # carries no types

_SAME = 1e-9  # relative, of two sampling times
_HOLDS = 1e-8  # change per sample of a state that holds, relative to the state
_STABLE = 1.0 - 1e-9

Row = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class SampledController:
    """A sampled linear controller of n states from one or two inputs to one output.

    Attributes:
        period: between two samples [s].
        transition: (n, n) A.
        input: (n, m) B; m = 1: the error, m = 2: reference and measured output.
        output: (n,) C.
        direct: (m,) D.
        rest: (n,) state that gives the output 1 for ever without error; zeros if there is none,
            as there is no integrator.
        correction: (n,) by how much the state follows what limits take from the output: state +=
            correction x (given less wanted).
    """

    period: float
    transition: tuple[Row, ...]
    input: tuple[Row, ...]
    output: Row
    direct: Row
    rest: Row
    correction: Row


def sampled_controller(
    system: Any,
    period: float,
    *,
    method: str = "tustin",
    back_calculation: FloatArray | None = None,
) -> SampledController:
    """Numbers of a controller that was designed with python-control.

    By default the controller is conditioned, so that its state does not wind up at limits (Hanus,
    Kinnaert and Henrotte 1987): the correction B/D makes the state what it would have been under
    the error that gives the limited output. A controller without direct path (D = 0), or with a
    zero that is not stable, is not conditioned and winds up, unless ``back_calculation`` is given.

    Args:
        system: ``TransferFunction`` or ``StateSpace`` from the error, or from reference and
            measured output, to the input of the plant.
        period: between two samples [s]; of a discrete system its own.
        method: of ``control.sample_system``, for a continuous system.
        back_calculation: (n,) corrections of the states of the sampled system; zeros for none.

    Raises:
        InputError: for other inputs and outputs, another sampling time, an improper system, or
            corrections of another number.
    """
    if not 0.0 < period < np.inf:
        raise InputError(f"period = {period:g} s must be above 0")
    if system.noutputs != 1 or system.ninputs not in (1, 2):
        raise InputError(
            f"the controller has {system.ninputs} inputs and {system.noutputs} outputs; give one"
            " from the error, or from reference and measured output, to one output"
        )
    if system.isdtime(strict=True):
        own = system.dt if system.dt is not True else period
        if abs(own - period) > _SAME * period:
            raise InputError(
                f"the controller is sampled at {own:g} s, the loop at {period:g} s; design it for"
                " that, or give a continuous one"
            )
        sampled = _in_state_space(system)
    else:
        sampled = _control.sample_system(_in_state_space(system), period, method=method)
    a, b, c, d = (
        np.asarray(part, np.float64) for part in (sampled.A, sampled.B, sampled.C, sampled.D)
    )
    correction = _correction(a, b, c, d) if back_calculation is None else back_calculation
    if np.shape(correction) != (a.shape[0],):
        raise InputError(
            f"back_calculation has the shape {np.shape(correction)}; it needs one number for"
            f" each of the sampled controller's {a.shape[0]} states"
        )
    return SampledController(
        period=period,
        transition=rows(a),
        input=rows(b),
        output=tuple(map(float, c[0])),
        direct=tuple(map(float, d[0])),
        rest=tuple(map(float, _rest(a, c))),
        correction=tuple(map(float, correction)),
    )


def _in_state_space(system: Any) -> Any:
    try:
        return _control.ss(system)
    except ValueError:  # more zeros than poles
        raise InputError(
            "the controller has more zeros than poles; add a lag, such as a derivative's filter"
        ) from None
    except NotImplementedError:  # python-control without slycot
        raise InputError(
            "a transfer function of two inputs needs slycot; give the controller as StateSpace"
        ) from None


def _correction(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """B/D of the first input, if the conditioned state is stable; else zeros."""
    if a.shape[0] and d[0, 0] != 0.0:
        gain = b[:, 0] / d[0, 0]
        if np.max(np.abs(np.linalg.eigvals(a - np.outer(gain, c[0])))) < _STABLE:
            return gain
    return np.zeros(a.shape[0])


def _rest(a: FloatArray, c: FloatArray) -> FloatArray:
    """The shortest state with A x = x and C x = 1; zeros if there is none."""
    _, sizes, axes = np.linalg.svd(a - np.eye(a.shape[0]))
    kept = axes[sizes < _HOLDS]
    seen = kept @ c[0]
    if not np.linalg.norm(seen) > _HOLDS * np.linalg.norm(c):
        return np.zeros(a.shape[0])
    return kept.T @ seen / (seen @ seen)


def rows(matrix: FloatArray) -> tuple[Row, ...]:
    """A matrix (n, m) as plain numbers."""
    return tuple(tuple(map(float, row)) for row in matrix)
