"""Every force law and every operator of the catalogs drives the arm, compiled as in Python."""

from dataclasses import replace

import numpy as np
import pytest

import pamsim
from pamsim.core.parameters import Sourced, specs
from pamsim.engine.rig import _compiled
from tests.both_backends import both_backends
from tests.unit.physics.muscles import FORCES, LOOPS

SPRING = {"passive.stiffness": 9000.0, "passive.softening": 33.0, "braid.extensibility": 0.0}
"""Weak enough when contracted to leave every law a pull: most hold the rubber's part themselves.
Pressure does not lengthen the braid: a pleated one cannot."""
CONTRACTED = {"mounting.length_at_zero": 0.225}
"""By 10 %, inside the range of every law."""


def step(duration, settle):
    made = pamsim.pressure_step((3e5, 3e5), (3e5, 1.8e5), duration=duration, load=1.2)
    return replace(made, settle=settle, sample_rate=100.0)


BRIEF = step(0.1, 0.05)  # Python is slow


def rig_with(group):
    """The shipped rig with another law or operator."""
    rig = pamsim.load_rig("mas20_arm")
    numbers = {
        name: Sourced(value=getattr(group, name), unit=spec.unit, source="assumed", where=name)
        for name, spec in specs(type(group))
    }
    sections = {**rig.file.muscle, group.group: {"law": group.law, **numbers}}
    return _compiled(replace(rig.file, muscle=sections))


@pytest.mark.parametrize("law", FORCES)
def test_every_force_law_drives_the_arm(law):
    rig = rig_with(FORCES[law]).with_parameters(SPRING | CONTRACTED)
    assert type(rig.muscles["muscle_1"].force).law == law
    run = both_backends(rig, BRIEF, exact=not law.startswith("pleated"))
    # Neither is a tension that follows the pressure: they run, and that is all they promise.
    if law not in ("single_pressure_exponential", "elastic_energy"):
        assert np.ptp(run.angle) > 1e-3
        assert np.all(run.tension >= 0.0)


@pytest.mark.parametrize("name", LOOPS)
def test_every_operator_runs_and_opens_a_loop(name):
    rig = rig_with(LOOPS[name])
    assert type(rig.muscles["muscle_1"].hysteresis).law == name
    assert np.ptp(both_backends(rig, BRIEF).angle) > 1e-3

    widths = ("force", "force_per_pressure", "force_share")
    off = rig.with_parameters({f"hysteresis.{width}": 0.0 for width in widths})
    one, other = (pamsim.simulate(r, step(0.4, 1.0)).completed().angle for r in (rig, off))
    assert 1e-4 < np.abs(one - other).max() < 0.2
