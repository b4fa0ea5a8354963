"""Volume and work of every law belong to its force, wherever the kernel asks for them."""

from __future__ import annotations

import pytest
import scipy.integrate
from pamsim.physics.force_laws.dispatch import (
    chosen_force,
    chosen_volume,
    chosen_work,
    user_force,
    user_work,
)

from pamsim.physics.force_laws.effective_area import EffectiveArea, Stroke
from pamsim.physics.muscle import Mounting, Muscle
from pamsim.physics.record import pack, slot
from tests.unit.physics.muscles import FORCES, make

FIRST, BRAID = slot("force.1"), slot("braid.nominal_length")
MUSCLES = {law: make(law) for law in FORCES}
MUSCLES["effective_area"] = Muscle(
    mounting=Mounting(length_at_zero=0.08),
    stroke=Stroke(nominal_length=0.1, damping=12.0),
    force=EffectiveArea(scale=1.0, area=5e-4, stiffness=300.0),
    chamber=make().chamber,
    valve=make().valve,
)


@pytest.mark.parametrize("pressure", [2.5e5, 4.5e5])
@pytest.mark.parametrize("law", MUSCLES)
def test_work_is_the_integral_of_the_force_and_volume_that_of_its_slope(law, pressure):
    par, near, step = pack(MUSCLES[law]).tolist(), 1e-5, 50.0
    code = par[slot("force.law")]

    def force(pressure, kappa):
        return chosen_force(code, par, FIRST, BRAID, pressure, kappa)

    def gained(kappa):
        return chosen_volume(code, par, FIRST, BRAID, pressure, kappa)

    def work(kappa):
        return chosen_work(code, par, FIRST, BRAID, pressure, kappa, gained(kappa))

    for kappa in (0.06, 0.1, 0.16):
        rise = (work(kappa + near) - work(kappa - near)) / (2.0 * near)
        assert rise == pytest.approx(force(pressure, kappa), rel=1e-4)
        rise = (gained(kappa + near) - gained(kappa - near)) / (2.0 * near)
        slope = (force(pressure + step, kappa) - force(pressure - step, kappa)) / (2.0 * step)
        assert rise == pytest.approx(slope, rel=1e-4)


def test_work_of_a_law_from_outside_is_the_integral_of_its_force_from_zero():
    """Any law that is known can stand for one."""
    par = pack(MUSCLES["six_parameter"]).tolist()
    code = par[slot("force.law")]
    for kappa in (0.02, 0.15):
        work = user_work(code, par, FIRST, BRAID, 3e5, kappa)
        expected, _ = scipy.integrate.quad(
            lambda at: user_force(code, par, FIRST, BRAID, 3e5, at), 0.0, kappa, epsabs=1e-12
        )
        assert work == pytest.approx(expected, rel=1e-8)
