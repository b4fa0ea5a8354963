"""Leave-one-out errors of one of several forms of a model, chosen without the row left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.core.units import FloatArray


@dataclass(frozen=True, kw_only=True)
class FittedForm:
    """One of several forms of a model, fitted to the same rows."""

    residual: FloatArray  # of the fit to all rows, (n,)
    jacobian: FloatArray  # of the residual there, (n, p); p may be 0
    left_out: FloatArray  # error at each row by the fit without it, (n,)


def nested_leave_one_out(forms: Sequence[FittedForm]) -> tuple[FloatArray, list[int]]:
    """Errors at rows (n,) whose form was chosen without them, too, and the number of that form.

    For each row, the form is taken whose leave-one-out error at the other rows, itself without this
    row, is least. These inner errors are those of refits linear about the fit to all rows.
    """
    count = forms[0].residual.size
    inner = np.array([_without_pairs(form) for form in forms])
    chosen = [int(np.argmin(np.sum(inner[:, i] ** 2, axis=1))) for i in range(count)]
    return np.array([forms[form].left_out[i] for i, form in enumerate(chosen)]), chosen


def _without_pairs(form: FittedForm) -> FloatArray:
    """Error at row j of the fit without rows i and j, (n, n); zero for i = j.

    It is infinite where the other rows do not determine the fit: such a form is not chosen.
    """
    hat = form.jacobian @ np.linalg.pinv(form.jacobian)
    free = 1.0 - np.diag(hat)
    determinant = np.outer(free, free) - hat**2
    errors = np.full_like(hat, np.inf)
    np.divide(
        np.outer(free, form.residual) + hat * form.residual[:, np.newaxis],
        determinant,
        out=errors,
        where=determinant > 1e-12,
    )
    np.fill_diagonal(errors, 0.0)
    return errors
