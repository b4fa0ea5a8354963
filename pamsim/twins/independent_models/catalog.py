"""All foreign truths, and how those that are hidden together become rig, hooks and recordings.

Other formulations, beside a time step half as long for all of them:

    command       valve_delay (bus with ticks), line_lag (two lags), valve_dead_zone (gradual)
    pneumatic     valve_flow (critical ratio too), supply_sag (reservoir), air_leak (laminar),
                  thermal_relaxation (heat exchange)
    muscle        muscle_hysteresis (Maxwell slip), viscoelastic_creep (two branches),
                  threshold_pressure (no kink), passive_stiffness (cubic), end_shape (cone),
                  muscle_mismatch (two coefficients)
    transmission  chain_backlash (elastic teeth), chain_compliance (hardening)
    joint         coulomb_friction and stribeck_friction (LuGre), viscous_friction (power of 1.25),
                  load_torque (another axis), added_inertia (the step only: inertia is inertia)
    measurement   angle_ and pressure_lag (second order), _scale and _bias (bent)
"""

from __future__ import annotations

from collections.abc import Iterable

from pamsim.core.errors import InputError, nearest
from pamsim.effects.catalog import EFFECTS
from pamsim.twins.independent_models import (
    air,
    command,
    joint,
    measurement,
    muscle,
    outside,
    transmission,
)
from pamsim.twins.independent_models.independent_model import Truth


def _by_name(truths: Iterable[Truth]) -> dict[str, Truth]:
    return {truth.name: truth for truth in truths}


FORMULATIONS: dict[str, Truth] = _by_name(
    (
        *command.TRUTHS,
        *air.TRUTHS,
        *muscle.TRUTHS,
        *transmission.TRUTHS,
        *joint.TRUTHS,
        *measurement.TRUTHS,
    )
)
"""Name of an effect -> its other formulation, in the order in which they act in a time step."""

OUTSIDE: dict[str, Truth] = _by_name(outside.TRUTHS)
"""Name -> truth that the library does not hold."""

ORDER: tuple[str, ...] = (*FORMULATIONS, *OUTSIDE)
"""Names in the order in which their laws act in a time step."""


def foreign_truth(name: str, *, differently: bool) -> Truth | None:
    """The foreign truth that a name stands for.

    Args:
        name: of an effect or of a truth outside the library.
        differently: whether effects of the library are wanted in their other formulation.

    Returns:
        The truth, or None for an effect as the library formulates it.

    Raises:
        InputError: if nothing has that name, or the effect has no other formulation.
    """
    if name in OUTSIDE:
        return OUTSIDE[name]
    if name not in EFFECTS:
        raise InputError(f"no effect {name!r}; {nearest(name, [*EFFECTS, *OUTSIDE])}")
    if not differently:
        return None
    if name not in FORMULATIONS:
        raise InputError(
            f"{name} has no other formulation; these have: {', '.join(sorted(FORMULATIONS))}"
        )
    return FORMULATIONS[name]
