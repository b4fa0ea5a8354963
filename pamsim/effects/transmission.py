"""Effects in the chain between muscle and joint: backlash, compliance, ripple of the teeth."""

from __future__ import annotations

from dataclasses import replace

from pamsim.effects.effect import SECOND_MUSCLE, Effect, shape, size

_RIPPLE = size("chain.ripple", 5e-5, 0.0, 3e-4)

# Of fewer than some six teeth no sprocket is made: 1.3e-2.
_PITCH = shape("chain.ripple_pitch", 9.525e-3, 4e-3, 1.3e-2, starts=(5e-3, 6.35e-3, 8e-3, 1.27e-2))

_PHASE = shape("chain.ripple_phase", 0.0, -3.2, 3.2, starts=(-1.6, 1.6, 3.1), natural_ends=True)

EFFECTS = (
    Effect(
        link="transmission", family="backlash", name="chain_backlash", form="rigid_teeth",
        missing="backlash between chain and sprocket",
        equation="l_muscle = l + s, |s| <= g/2, s' = (T_other - T) / b between the teeth",
        parameters=(size("chain.backlash", 3e-4, 0.0, 5e-3),),
        look_alikes=("muscle_hysteresis", "coulomb_friction"),
        separating="small reversals at low stiffness, the angle read on both sides of the chain",
        path_dependent=True,
    ),
    Effect(
        link="transmission", family="backlash", name="chain_backlash", form="elastic_teeth",
        missing="backlash between chain and sprocket, whose teeth give",
        equation="l_muscle = l + s, s' = (T_other - T - (s -+ g/2) / c) / b beyond the backlash",
        parameters=(
            size("chain.backlash", 3e-4, 0.0, 5e-3),
            # As much as two end fittings give, see chain_compliance.
            shape("chain.tooth_compliance", 2e-6, 0.0, 4e-5, starts=(5e-7,)),
            # At its ends the chain slides as soon as it is pulled, or hardly at all.
            shape("chain.seating_damping", 1e3, 1e2, 1e4, starts=(3e2, 3e3), natural_ends=True),
        ),
        look_alikes=("muscle_hysteresis", "coulomb_friction"),
        separating="small reversals at low stiffness, the angle read on both sides of the chain",
        path_dependent=True,
    ),
    Effect(
        link="transmission", family="compliance", name="chain_compliance", form="constant",
        missing="compliance of the chain and the end fittings",
        equation="l_muscle = l - e, e' = (C T - e) / tau",
        parameters=(size("chain.compliance", 1e-6, 0.0, 2e-5),),
        look_alikes=("passive_stiffness", "threshold_pressure"),
        separating="lock the arm, change the pressures, and measure the chain's extension",
    ),
    Effect(
        link="transmission", family="compliance", name="chain_compliance", form="hardening",
        missing="compliance of the chain and the end fittings, which seat themselves under tension",
        equation="l_muscle = l - e, e' = (C ln(1 + h T) / h - e) / tau",
        parameters=(
            size("chain.compliance", 1e-6, 0.0, 4e-5),
            # Half as compliant at 500 N, a middle tension of a MAS-20.
            shape("chain.hardening", 2e-3, 0.0, 0.1, starts=(5e-4, 1e-2)),
        ),
        look_alikes=("passive_stiffness", "threshold_pressure"),
        separating="lock the arm, change the pressures, and measure the chain's extension",
    ),
    Effect(
        link="transmission", family="sprocket_ripple", name="sprocket_ripple", form="one_phase",
        missing="travel of the chain that ripples from tooth to tooth of the sprocket",
        equation="x_muscle = x + a sin(2 pi x / pitch + phase)",
        parameters=(_RIPPLE, _PITCH, _PHASE),
        look_alikes=("angle_scale", "chain_backlash"),
        separating="turn the arm slowly through several teeth at one pressure and read the angle",
        rare=True,
    ),
    Effect(
        link="transmission", family="sprocket_ripple", name="sprocket_ripple", form="two_phases",
        missing="travel of the chain that ripples from tooth to tooth of the sprocket, with a phase"
        " of its own at either end, as where a torque ripples with the angle",
        equation="x_muscle = x + a sin(2 pi x / pitch + phase), with a phase for each muscle",
        parameters=(
            _RIPPLE,
            # Longer ones with two phases take any smooth shape.
            replace(_PITCH, high=1e-2, starts=(5e-3, 7e-3)),
            replace(_PHASE, starts=(-2.1, 2.1)),
            replace(_PHASE, name=f"{SECOND_MUSCLE}:{_PHASE.name}", starts=(-2.1, 2.1)),
        ),
        look_alikes=("angle_scale", "chain_backlash"),
        separating="turn the arm slowly through several teeth at one pressure and read the angle",
        rare=True, crossed=True,
    ),
)  # fmt: skip
