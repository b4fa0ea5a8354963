"""Intervals of fitted parameters are those of refits, and of the noise where that is wider."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import t as student_t

from pamsim.diagnosis.by_link.link_fit import PRIOR
from pamsim.diagnosis.by_link.sizes import SizeErrors

NAMES, SCALE, STATED = ("scale", "delay", "unseen"), np.array([4.0, 1e-3, 1.0]), 4.0
UNITS = np.repeat(np.arange(6), 10)


def errors(groups, missed):
    """Errors of a nuisance parameter, an effect and one without influence; what is missed grows."""
    rng = np.random.default_rng(0)
    jacobian = np.column_stack([rng.normal(size=(60, 2)), np.zeros(60)])
    rows = 0.3 * rng.normal(size=60) + missed * UNITS * jacobian[:, 1]
    fitter = SimpleNamespace(
        nuisance={"scale": STATED},
        units=SimpleNamespace(fitted=SimpleNamespace(group_of=UNITS % groups, unit_of=UNITS)),
        scale=lambda name, effects: SCALE[NAMES.index(name)],
    )
    model = SimpleNamespace(
        effects=(),
        rows=rows,
        jacobian=lambda: jacobian,
        sensitivities=dict.fromkeys(NAMES),
        values={"scale": 4.4, "delay": 1.0, "unseen": 0.0},
    )
    return jacobian, rows, SizeErrors(fitter, model)


@pytest.mark.parametrize(("groups", "left_out"), [(3, UNITS % 3), (2, UNITS)])
def test_the_wider_of_two_errors_counts_of_noise_and_of_refits_without_each_input(groups, left_out):
    """Without each unit, of one input or two; what the prior holds is held in the refits, too."""
    weight = np.array([1.0 / PRIOR, 0.0])
    for missed in (0.0, 3.0):
        jacobian, rows, found = errors(groups, missed)
        seen, moved = jacobian[:, :2], []
        for one in np.unique(left_out):
            kept = left_out != one
            columns = np.vstack([seen[kept], np.diag(weight)])
            off = np.concatenate([rows[kept], weight * (4.4 / STATED - 1.0)])
            moved.append(-np.linalg.lstsq(columns, off, rcond=None)[0])
        count = len(moved)
        jackknife = np.sqrt((count - 1) * np.var(moved, axis=0)) * student_t.ppf(0.975, count - 1)
        noise = np.sqrt(np.diag(np.linalg.inv(seen.T @ seen + np.diag(weight**2))))
        wider = SCALE[:2] * np.maximum(1.96 * noise, jackknife)
        ones = {name: np.ones(1) for name in NAMES}
        reach = [found.reach({name: ones[name]})[0] for name in NAMES]
        assert reach == pytest.approx([*wider, np.inf])
        assert found.reach(ones) == np.inf
