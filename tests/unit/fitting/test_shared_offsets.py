"""A force law fitted to sweeps with an offset each: intervals allow for it, the notes state it."""

import numpy as np

from pamsim.core.encoding import to_dict
from pamsim.fitting.curve_fit import fit_curve
from pamsim.fitting.force_map import fit_force_law, law_coefficients, law_curve, named_law
from pamsim.physics.braid import Braid
from pamsim.recordings.measured_table import ForceMap

BRAID = Braid(nominal_length=0.25, diameter=0.02, fibre_angle=0.4)
LAW = named_law("six_parameter")
PLANTED = {"scale": 1.0, "a": -4e-5, "b": 290.0, "c": -33.0, "d": -9e-3, "e": 3e-3, "f": -280.0}


def drawn(offset):
    """A map of six sweeps, each with an offset of its own [N] beside noise of 5 N."""
    rng, grid = np.random.default_rng(3), (6, 10)
    pressure, contraction = np.meshgrid(np.linspace(1e5, 6e5, 6), np.linspace(0.0, 0.2, 10))
    place = {"pressure": pressure.T.ravel(), "contraction": contraction.T.ravel()}
    bare = ForceMap(**place, force=np.zeros(60), nominal_length=0.25)
    names = [one.name for one in law_coefficients(LAW, BRAID, {})]
    exact = law_curve(LAW, bare, BRAID, np.arange(60))(np.array([PLANTED[n] for n in names]))
    errors = 5.0 * rng.normal(size=grid) + offset * rng.normal(size=(6, 1))
    return ForceMap(**place, force=exact + errors.ravel(), nominal_length=0.25)


def widths(fit):
    return np.array([c.interval95[1] - c.interval95[0] for c in fit.coefficients if c.interval95])


def alone(table):
    """The same fit, its points taken as independent."""
    curve = law_curve(LAW, table, BRAID, np.arange(60))
    return fit_curve(curve, table.force, law_coefficients(LAW, BRAID, {}))


def test_sweeps_with_an_offset_each_widen_intervals_and_are_reported():
    table = drawn(20.0)
    found = fit_force_law(table, "six_parameter", BRAID, held={}, hold_out="none")
    assert set(found.fit.shared) == {"pressure"}
    (note,) = [note for note in found.notes if "share an error" in note]
    assert note.startswith("points of one pressure share an error")
    assert to_dict(found.fit)["shared"] == dict(found.fit.shared)
    np.testing.assert_array_equal(found.fit.values, alone(table).values)
    # Offsets are in what depends on pressure alone, and not in what differs along a sweep.
    names = [c.name for c in found.fit.coefficients if c.interval95]
    wider = dict(zip(names, widths(found.fit) / widths(alone(table)), strict=True))
    assert min(wider["e"], wider["f"]) > 1.5
    assert max(wider["b"], wider["c"], wider["d"]) < 0.7


def test_points_without_a_common_error_are_taken_as_independent():
    table = drawn(0.0)
    found = fit_force_law(table, "six_parameter", BRAID, held={}, hold_out="none")
    assert (found.fit.shared, found.notes) == ({}, ())
    np.testing.assert_array_equal(widths(found.fit), widths(alone(table)))
