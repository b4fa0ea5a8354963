"""Size of a fitted effect in physical terms that do not depend on its form, with 95 % intervals.

It is that at one place: the joint or the muscle that has the effect; of an effect on all muscles,
the first muscle, and the joint over which that one has its largest arm.

A size is a function of the effect's parameters, found by `pamsim.diagnosis.virtual_tests` on the
fitted rig with and without the effect. Its interval is that of the parameters carried through, by
the delta method to the point of their 95 % ellipsoid at which the size is largest and smallest to
first order. There the test is made again, so that the interval need not be symmetric; that of a
single parameter is the test at both ends of its interval. The widths of the ellipsoid are the
intervals of the fit, its correlations those of the fit's Jacobian. What nuisance parameters do to a
size, a change of a change, is left out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.candidate import Candidate
from pamsim.core.units import FloatArray
from pamsim.diagnosis.bench import CONDITIONS, bench
from pamsim.diagnosis.fitted_rig import with_fitted
from pamsim.diagnosis.virtual_tests import TESTS, Quantities
from pamsim.effects.effect import AT
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig


@dataclass(frozen=True, kw_only=True)
class PhysicalSize:
    """One quantity of an effect's size, or a condition under which it was found."""

    value: float  # [unit]
    unit: str  # SI unit
    # Ends of the 95 % interval [unit]; None for a condition and where it is not known
    interval95: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """The estimates of a fit, for all effects in it."""

    values: Mapping[str, float]  # rig parameter -> value [SI], refitted ones among them
    intervals: Mapping[str, tuple[float, float]]  # parameter of an effect -> 95 % interval [SI]
    parameters: Sequence[str]  # of all effects, p of them
    # Change of the residual with each of these, (n, p); what the data do not show counts as not
    # correlated
    jacobian: FloatArray


def physical_sizes(rig: Rig, fitted: Fitted, effect: Candidate) -> dict[str, PhysicalSize]:
    """Quantity -> size of one of the effects that were fitted to a rig that has none of them."""
    virtual_test = TESTS.get(effect.name.partition(AT)[0])
    if virtual_test is None:
        return {}  # an effect from outside the package, which no test was written for
    names = [parameter.name for parameter in effect.parameters]
    rest = {name: value for name, value in fitted.values.items() if name not in names}
    joint, muscle = tested_joint(rig, names[0]), tested_muscle(rig, names[0])
    without = bench(with_fitted(rig, rest), joint)

    best = np.array([fitted.values[name] for name in names])
    low, high = np.array([_allowed_interval(rig, fitted, name) for name in names]).T

    def test(values: FloatArray) -> Quantities:
        inside = np.minimum(np.maximum(values, np.minimum(low, best)), np.maximum(high, best))
        chosen = dict(zip(names, inside.tolist(), strict=True))
        there = bench(with_fitted(rig, {**fitted.values, **chosen}), joint)
        return virtual_test(there, without, muscle)

    found = test(best)
    ends: dict[str, tuple[float, float]] = {}
    if np.all(np.isfinite(low) & np.isfinite(high)):
        below, above = np.maximum(best - low, 0.0), np.maximum(high - best, 0.0)
        sides = [
            (test(best - down), test(best + up))
            for down, up in zip(np.diag(below), np.diag(above), strict=True)
        ]
        together = correlation(fitted, names)
        for name in found:
            if name in CONDITIONS or any(name not in t for pair in sides for t in pair):
                continue
            slope = np.array([0.5 * (up[name][0] - down[name][0]) for down, up in sides])
            size = math.sqrt(max(float(slope @ together @ slope), 0.0))
            toward = together @ slope / size if size > 0.0 else np.zeros(len(names))
            tried = [found[name][0]]
            for way in (toward, -toward):
                at = best + np.where(way > 0.0, above, below) * way
                tried.append(test(at).get(name, (math.nan, ""))[0])
            if np.all(np.isfinite(tried)):
                ends[name] = (min(tried), max(tried))
    return {
        name: PhysicalSize(value=value, unit=unit, interval95=ends.get(name))
        for name, (value, unit) in found.items()
    }


def _allowed_interval(rig: Rig, fitted: Fitted, name: str) -> tuple[float, float]:
    """The part of a parameter's 95 % interval that its range allows; infinite if not known.

    An interval by leaving out rows is symmetric and may reach beyond the range. Where it reaches
    an end that is itself not allowed, the test cannot be made there.
    """
    low, high = fitted.intervals.get(name, (-math.inf, math.inf))
    spec = rig_parameter(rig, name).spec
    if not (math.isfinite(low) and math.isfinite(high)) or (spec.low_open and low <= spec.low):
        return -math.inf, math.inf
    return max(low, spec.low), min(high, spec.high)


def tested_muscle(rig: Rig, parameter: str) -> int:
    """Index of the muscle to test an effect at: the only one of its parameter, or the first."""
    only = ParameterName.parse(parameter).muscle
    return list(rig.muscles).index(only) if only else 0


def tested_joint(rig: Rig, parameter: str) -> str:
    """The joint to test an effect at: the only one of its parameter, or else the rig's first.

    A muscle's effect is tested at the joint that the muscle has its largest arm over.
    """
    if ParameterName.parse(parameter).owner == "muscle":
        muscle = tested_muscle(rig, parameter)
        return max(rig.joints, key=lambda joint: abs(bench(rig, joint).arms[muscle]))
    own = parameter.split(".")[1] if parameter.startswith("joint.") else ""
    return own if own in rig.joints else next(iter(rig.joints))


def correlation(fitted: Fitted, names: Sequence[str]) -> FloatArray:
    """Correlations of the estimates of some of the parameters, shape (k, k)."""
    norms = np.linalg.norm(fitted.jacobian, axis=0)
    shown = norms > 1e-9 * max(float(norms.max(initial=0.0)), np.finfo(float).tiny)
    scaled = fitted.jacobian[:, shown] / norms[shown]
    matrix = np.eye(len(norms))
    matrix[np.ix_(shown, shown)] = np.linalg.pinv(scaled.T @ scaled)
    chosen = [fitted.parameters.index(name) for name in names]
    part = matrix[np.ix_(chosen, chosen)]
    errors = np.sqrt(np.diag(part))
    return part / np.outer(errors, errors)
