"""Splines that are natural at their ends, by scipy."""

import numpy as np
from scipy.interpolate import BSpline


def by_scipy(control, ends, x):
    """Value at a place of the curve of control values between two ends."""
    spacing = (ends[1] - ends[0]) / (len(control) - 1)
    knots = ends[0] + spacing * np.arange(-3, len(control) + 3)
    beyond = 2.0 * control[0] - control[1], 2.0 * control[-1] - control[-2]
    return BSpline(knots, [beyond[0], *control, beyond[1]], 3)(x)
