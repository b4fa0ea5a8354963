"""The muscle's own force, formulated otherwise."""

from __future__ import annotations

import math

from pamsim.actuator.layout import slot
from pamsim.comparison.effects_on_rig import rig_name
from pamsim.effects.catalog import effect
from pamsim.effects.effect import SECOND_MUSCLE
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.hysteresis.play import play
from pamsim.twins.independent_models.independent_model import Law, Truth
from pamsim.twins.independent_models.plant import Occasion, Plant

_SLIPS = (8e-4, 2e-3, 4e-3, 7e-3)
"""Contractions at which the blocks of the Maxwell-slip bank begin to slip [-]."""

_SHARES = (0.35, 0.3, 0.2, 0.15)
"""Of its force that each of them carries; they add up to 1."""

_BRANCHES = ((0.55, 0.25), (0.45, 2.5))
"""Share of the stiffness and relaxation time [s] of each Maxwell branch of the creep."""

_THRESHOLD = slot("threshold.pressure")

_SETS_IN = 8e4
"""Pressure over which the smooth threshold sets in, if it is not itself higher [Pa]."""

_CURVATURE = 0.02
"""Stretch at which the passive spring's cubic part is as strong as its linear one [-]."""

_CONE = 2.0
"""Force share lost per contraction beyond the onset, of the library's largest loss [-]."""

_BEND = 4e-3
"""Contraction over which the loss to the ends sets in [-]."""


class MaxwellSlipBank:
    """Springs that drag blocks, their force in proportion to the pressure, on each muscle.

    Args:
        force_per_pressure: of all blocks slipping [N/Pa].
    """

    def __init__(self, force_per_pressure: float) -> None:
        self._gain = force_per_pressure
        self._blocks: dict[int, list[float]] = {}

    def output(self, muscle: int, contraction: float) -> float:
        """Share of the largest force, in [-1, 1], at the next contraction [-] of a muscle."""
        blocks = self._blocks.setdefault(muscle, [contraction] * len(_SLIPS))
        total = 0.0
        for k, slip in enumerate(_SLIPS):
            blocks[k] = play(contraction, blocks[k], slip)
            total += _SHARES[k] * (contraction - blocks[k]) / slip
        return total

    def __call__(self, plant: Plant) -> None:
        """Hold the muscles back."""
        for i in plant.muscles:
            force = self._gain * max(plant.pressure(i), 0.0)
            plant.pull[i] -= force * self.output(i, plant.contraction(i))


class TwoBranchCreep:
    """Two Maxwell elements beside each muscle, at rest when time starts.

    Args:
        stiffness: of both together [N].
    """

    def __init__(self, stiffness: float) -> None:
        self._branches = [(share * stiffness, time) for share, time in _BRANCHES]
        self._relaxed: dict[int, list[float]] = {}

    def pull(self, muscle: int, contraction: float, timestep: float) -> float:
        """Force [N] that the elements add to a muscle's pull at the next contraction [-]."""
        relaxed = self._relaxed.setdefault(muscle, [contraction] * len(self._branches))
        total = 0.0
        for k, (stiffness, time) in enumerate(self._branches):
            total -= stiffness * (contraction - relaxed[k])
            relaxed[k] += (contraction - relaxed[k]) * timestep / (time + timestep)
        return total

    def __call__(self, plant: Plant) -> None:
        """Pull, once the rig has come to rest."""
        if plant.resting:
            return
        for i in plant.muscles:
            plant.pull[i] += self.pull(i, plant.contraction(i), plant.timestep)


def smooth_threshold(pressure: float, threshold: float) -> float:
    """Pressure lost in the tube [Pa]: nothing at none, the threshold in the end, without a kink.

    Args:
        pressure: gauge [Pa].
        threshold: lost at high pressure [Pa].
    """
    return -threshold * math.expm1(-max(pressure, 0.0) / max(threshold, _SETS_IN))


def cubic_spring(stretch: float, stiffness: float) -> float:
    """Force of a spring that hardens on both sides [N].

    Args:
        stretch: [-].
        stiffness: [N] where it is free.
    """
    return stiffness * stretch * (1.0 + (stretch / _CURVATURE) ** 2)


def cone_loss(contraction: float, loss: float, onset: float) -> float:
    """Share of the active force that ends of a growing cone take, in proportion to contraction.

    Args:
        contraction: [-].
        loss: as the library's parameter [-].
        onset: contraction about which it sets in [-].
    """
    beyond = contraction - onset
    return min(0.5 * _CONE * loss * (beyond + math.hypot(beyond, _BEND)), 1.0)


def _hysteresis(size: float, occasion: Occasion) -> Law:
    return MaxwellSlipBank(size * effect("muscle_hysteresis").parameters[0].typical)


def _creep(size: float, occasion: Occasion) -> Law:
    return TwoBranchCreep(size * effect("viscoelastic_creep").parameters[0].typical)


def _threshold(size: float, occasion: Occasion) -> Law:
    lost = size * effect("threshold_pressure").parameters[0].typical

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            plant.user[i, _THRESHOLD] = smooth_threshold(plant.pressure(i), lost)

    return law


def _passive(size: float, occasion: Occasion) -> Law:
    parameter = effect("passive_stiffness").parameters[0]
    own = rig_parameter(occasion.rig, parameter.name).value
    slack = rig_parameter(occasion.rig, "passive.slack_contraction").value
    more = size * (parameter.typical - 1.0) * own

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            plant.pull[i] += cubic_spring(slack - plant.contraction(i), more)

    return law


def _ends(size: float, occasion: Occasion) -> Law:
    loss, onset = (p.typical for p in effect("end_shape").parameters)

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            force = max(plant.active_force(i, plant.pressure(i)), 0.0)
            plant.pull[i] -= force * cone_loss(plant.contraction(i), size * loss, onset)

    return law


def _mismatch(rig: Rig, size: float) -> dict[str, float]:
    more = size * (effect("muscle_mismatch").parameters[0].typical - 1.0)
    second = rig_name(rig, f"{SECOND_MUSCLE}:force")
    return {
        name: rig_parameter(rig, name).value * (1.0 + share * more)
        for name, share in ((f"{second}.e", 1.0), (f"{second}.d", 3.0))
    }


TRUTHS = (
    Truth(
        name="muscle_hysteresis",
        formulation="a Maxwell-slip bank of four blocks, its force in proportion to the pressure",
        law=_hysteresis,
    ),
    Truth(
        name="viscoelastic_creep",
        formulation="two Maxwell branches that relax in 0.25 s and 2.5 s",
        law=_creep,
    ),
    Truth(
        name="threshold_pressure",
        formulation="a loss of pressure that sets in without a kink",
        law=_threshold,
    ),
    Truth(
        name="passive_stiffness",
        formulation="a cubic spring beside the muscle",
        law=_passive,
        signed=True,
    ),
    Truth(
        name="end_shape",
        formulation="a loss of force in proportion to contraction beyond a smooth onset",
        law=_ends,
    ),
    Truth(
        name="muscle_mismatch",
        formulation="coefficients e and d of muscle 2's law differ, d three times as much",
        parameters=_mismatch,
        signed=True,
    ),
)
"""Truths of the muscle's force."""
