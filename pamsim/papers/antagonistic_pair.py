"""The MAS-20 rig's muscle at rest, without the engine: as identified, and as an ideal one."""

from __future__ import annotations

import dataclasses
import functools

from pamsim.papers.numerics import root
from pamsim.physics.antagonist import antagonist_torque
from pamsim.physics.braid import max_contraction
from pamsim.physics.force_laws.force_law import ForceParameters
from pamsim.physics.force_laws.mckibben import IdealMcKibben
from pamsim.physics.force_laws.published import PUBLISHED
from pamsim.physics.muscle import Mounting, Muscle, build_muscle
from pamsim.physics.passive import PassiveSpring
from pamsim.physics.record import parameters
from pamsim.physics.tension import Threshold
from pamsim.recordings.rig_file import read_rig

MILLIMETRE = 1e-3
"""[m]."""

_HAIR = 1e-6
"""Pull that moves nothing [N]."""

_STRIDE = 4.0 * MILLIMETRE


_file = functools.cache(lambda: read_rig("mas20_arm"))


@functools.cache
def rig_muscle() -> Muscle:
    """Either muscle of the rig; its numbers and their sources stand in its ``params.toml``."""
    return build_muscle(_file().muscle, where="mas20_arm")


@functools.cache
def ideal_muscle() -> Muscle:
    """The rig's braid and air with the ideal law alone, at half its stroke where the angle is 0.

    That is the reference point E of equation (1), with its minus restored.
    """
    braid = rig_muscle().braided
    length = braid.nominal_length * (1.0 - 0.5 * max_contraction(braid.fibre_angle))
    return dataclasses.replace(_with_force(IdealMcKibben(), length), threshold=Threshold())


def _with_force(force: ForceParameters, length: float) -> Muscle:
    """The rig's muscle with another force alone, mounted at a length [m]."""
    muscle = rig_muscle()
    return dataclasses.replace(
        muscle,
        mounting=Mounting(length_at_zero=length),
        braid=dataclasses.replace(muscle.braided, extensibility=0.0),
        force=force,
        passive=PassiveSpring(),
        hysteresis=None,
    )


def published_muscle(length: float) -> Muscle:
    """The rig's braid with the published force map of a DMSP-20-200 as printed and nothing else.

    It is mounted at a length [m], that at the reference point.
    """
    return _with_force(PUBLISHED["DMSP-20-200"], length)


def sprocket_radius() -> float:
    """Radius of the rig's sprocket [m]; assumed, the paper prints none."""
    return _file().native["tendon.chain_1.coef"].si("m")


def stroke(muscle: Muscle) -> float:
    """Largest shortening of the ideal law [m]."""
    return muscle.braided.nominal_length * max_contraction(muscle.braided.fibre_angle)


def rest_travel(muscle: Muscle, pressures: tuple[float, float]) -> float:
    """How far muscle 1 has shortened and muscle 2 lengthened where they balance without load [m].

    Two slack muscles hold nothing: the travel is that at which the driving one goes slack. The
    pressures are gauge [Pa].
    """
    pair = (parameters(muscle), parameters(muscle))
    way = 1.0 if pressures[0] > pressures[1] else -1.0

    def drive(travel: float) -> float:
        return way * antagonist_torque(pair, 1.0, way * travel, pressures) - _HAIR

    far = 0.0
    while drive(far) > 0.0:  # the first balance: a law may have others where it no longer holds
        far += _STRIDE
    return way * root(drive, max(far - _STRIDE, 0.0), far, 1e-9) if far else 0.0


def rest_angle(muscle: Muscle, pressures: tuple[float, float]) -> float:
    """Angle at which two such muscles of these gauge pressures [Pa] balance without load [rad]."""
    pair, radius = (parameters(muscle), parameters(muscle)), sprocket_radius()
    limit = 0.5 * stroke(muscle) / radius

    def torque(angle: float) -> float:
        return antagonist_torque(pair, radius, angle, pressures)

    return root(torque, -limit, limit, 1e-12)
