"""All effects, in the order of the layers from joint to sensor."""

from __future__ import annotations

from pamsim.core.errors import InputError, nearest
from pamsim.effects import (
    added_inertia,
    air_leak,
    angle_bias,
    angle_lag,
    angle_scale,
    braid_extensibility,
    braid_locking,
    chain_backlash,
    chain_compliance,
    coulomb_friction,
    end_shape,
    force_slope,
    line_lag,
    load_torque,
    muscle_hysteresis,
    muscle_mismatch,
    passive_stiffness,
    pressure_bias,
    pressure_lag,
    pressure_scale,
    rest_length,
    stretch_weakening,
    stribeck_friction,
    supply_sag,
    thermal_relaxation,
    threshold_pressure,
    valve_dead_zone,
    valve_delay,
    valve_flow,
    viscoelastic_creep,
    viscous_friction,
)
from pamsim.effects.effect import Effect

EFFECTS: dict[str, Effect] = {
    module.EFFECT.name: module.EFFECT
    for module in (
        coulomb_friction,
        stribeck_friction,
        viscous_friction,
        load_torque,
        added_inertia,
        muscle_hysteresis,
        viscoelastic_creep,
        threshold_pressure,
        passive_stiffness,
        end_shape,
        muscle_mismatch,
        air_leak,
        supply_sag,
        valve_dead_zone,
        valve_flow,
        thermal_relaxation,
        valve_delay,
        line_lag,
        chain_backlash,
        chain_compliance,
        angle_bias,
        angle_scale,
        angle_lag,
        pressure_bias,
        pressure_scale,
        pressure_lag,
    )
}
"""Name -> effect."""

MUSCLE_SHAPE: dict[str, Effect] = {
    module.EFFECT.name: module.EFFECT
    for module in (
        braid_locking,
        braid_extensibility,
        stretch_weakening,
        force_slope,
        rest_length,
    )
}
"""Name -> effect on what a muscle does at rest, at lengths and pressures its law was not made for.
Tables of angles at rest are searched for them; for trials over time they are numbers of the force
law, close to its scale and its passive spring, and not searched for."""


def effect(name: str) -> Effect:
    """Look an effect up.

    Raises:
        InputError: if there is none of that name, with the nearest.
    """
    known = EFFECTS | MUSCLE_SHAPE
    if name not in known:
        raise InputError(f"no effect {name!r}; {nearest(name, known)}")
    return known[name]
