"""Equations of the papers in another form, for tests of the laws and operators that have them."""

from __future__ import annotations

from pamsim.physics.force_laws.exponential import SinglePressureExponential, SixParameter


def isobar(law: SixParameter, pressure: float) -> SinglePressureExponential:
    """The law at one gauge pressure [Pa]: what Sarosi (3) is to (4)."""
    return SinglePressureExponential(
        scale=law.scale,
        a=law.a * pressure + law.b,
        b=law.c,
        d=law.d * pressure,
        e=law.e * pressure + law.f,
    )
