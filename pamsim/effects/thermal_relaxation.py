"""Heat exchanged between the air and the muscle."""

from __future__ import annotations

from pamsim.effects.effect import Effect, EffectParameter

EFFECT = Effect(
    name="thermal_relaxation",
    family="thermal",
    layer="pneumatic",
    missing="heat exchanged between the air and the muscle",
    parameters=(
        # Cut to 1 to 1.4: from air at constant temperature to air without any exchange of heat.
        EffectParameter(
            name="chamber.polytropic_index",
            typical=0.15,
            low=-0.4,
            high=0.4,
            neutral=None,
            natural_ends=True,
        ),
    ),
    signature="pressure ripples with the muscle's motion too much or too little, only in fast"
    " motion",
    look_alikes=("valve_flow", "valve_delay", "angle_scale"),
    separating="turn the arm by hand with the valves shut and read the pressures",
)
