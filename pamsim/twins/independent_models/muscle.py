"""Independent models of the muscle's force: Maxwell slip, two branches, smooth threshold, cone."""

from __future__ import annotations

import math

from pamsim.actuator.layout import slot
from pamsim.comparison.effects_on_rig import rig_name
from pamsim.effects.catalog import effect
from pamsim.effects.effect import SECOND_MUSCLE
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.hysteresis.play import play
from pamsim.twins.independent_models.independent_model import IndependentModel, Law
from pamsim.twins.independent_models.plant import Plant, RunContext

_SLIPS = (8e-4, 2e-3, 4e-3, 7e-3)
"""Contractions at which the blocks of the Maxwell-slip bank begin to slip [-]."""

_SHARES = (0.35, 0.3, 0.2, 0.15)
"""Share of the bank's force in each block; they add up to 1."""

_BRANCHES = ((0.55, 0.25), (0.45, 2.5))
"""Share of the stiffness and relaxation time [s] of each Maxwell branch of the creep."""

_THRESHOLD = slot("threshold.pressure")

_SETS_IN = 8e4
"""Pressure over which the smooth threshold builds up, unless the threshold is higher [Pa]."""

_CURVATURE = 0.02
"""Stretch at which the passive spring's cubic part is as strong as its linear one [-]."""

_CONE = 2.0
"""Force share lost per contraction beyond the onset, of the library's largest loss [-]."""

_BEND = 4e-3
"""Contraction over which the loss to the ends builds up [-]."""


class MaxwellSlipBank:
    """Springs that drag blocks on each muscle, with a force proportional to the pressure.

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
        """Subtract the friction force from each muscle's pull."""
        for i in plant.muscles:
            force = self._gain * max(plant.pressure(i), 0.0)
            plant.pull[i] -= force * self.output(i, plant.contraction(i))


class TwoBranchCreep:
    """Two Maxwell elements parallel to each muscle, relaxed at time 0.

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
        """Add the creep force once the rig has settled."""
        if plant.settling:
            return
        for i in plant.muscles:
            plant.pull[i] += self.pull(i, plant.contraction(i), plant.timestep)


def smooth_threshold(pressure: float, threshold: float) -> float:
    """Pressure lost in the tube [Pa]: rises smoothly from 0 to the threshold.

    Args:
        pressure: gauge [Pa].
        threshold: loss at high pressure [Pa].
    """
    return -threshold * math.expm1(-max(pressure, 0.0) / max(threshold, _SETS_IN))


def cubic_spring(stretch: float, stiffness: float) -> float:
    """Force of a spring that hardens on both sides [N].

    Args:
        stretch: [-].
        stiffness: at zero stretch [N].
    """
    return stiffness * stretch * (1.0 + (stretch / _CURVATURE) ** 2)


def cone_loss(contraction: float, loss: float, onset: float) -> float:
    """Share of the active force lost to growing conical ends, proportional to contraction.

    Args:
        contraction: [-].
        loss: as the library's parameter [-].
        onset: contraction around which the loss starts [-].
    """
    beyond = contraction - onset
    return min(0.5 * _CONE * loss * (beyond + math.hypot(beyond, _BEND)), 1.0)


def _hysteresis(size: float, context: RunContext) -> Law:
    return MaxwellSlipBank(size * effect("muscle_hysteresis").parameters[0].typical)


def _creep(size: float, context: RunContext) -> Law:
    return TwoBranchCreep(size * effect("viscoelastic_creep").parameters[0].typical)


def _threshold(size: float, context: RunContext) -> Law:
    lost = size * effect("threshold_pressure").parameters[0].typical

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            plant.user[i, _THRESHOLD] = smooth_threshold(plant.pressure(i), lost)

    return law


def _passive(size: float, context: RunContext) -> Law:
    parameter = effect("passive_stiffness").parameters[0]
    own = rig_parameter(context.rig, parameter.name).value
    slack = rig_parameter(context.rig, "passive.slack_contraction").value
    more = size * (parameter.typical - 1.0) * own

    def law(plant: Plant) -> None:
        for i in plant.muscles:
            plant.pull[i] += cubic_spring(slack - plant.contraction(i), more)

    return law


def _ends(size: float, context: RunContext) -> Law:
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


MODELS = (
    IndependentModel(
        name="muscle_hysteresis",
        formulation="a Maxwell-slip bank of four blocks, its force proportional to the pressure",
        law=_hysteresis,
    ),
    IndependentModel(
        name="viscoelastic_creep",
        formulation="two Maxwell branches that relax in 0.25 s and 2.5 s",
        law=_creep,
    ),
    IndependentModel(
        name="threshold_pressure",
        formulation="a loss of pressure that builds up smoothly",
        law=_threshold,
    ),
    IndependentModel(
        name="passive_stiffness",
        formulation="a cubic spring beside the muscle",
        law=_passive,
        signed=True,
    ),
    IndependentModel(
        name="end_shape",
        formulation="a loss of force proportional to contraction beyond a smooth onset",
        law=_ends,
    ),
    IndependentModel(
        name="muscle_mismatch",
        formulation="coefficients e and d of the second muscle's law differ, d three times as much",
        parameters=_mismatch,
        signed=True,
    ),
)
"""Independent models of the muscle effects."""
