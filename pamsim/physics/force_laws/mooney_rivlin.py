"""McKibben muscle with an elastic tube: virtual work of the air minus the energy of the rubber.

F = -p dV/dl - c1 I1'(k) / 2 - c2 I2'(k) / 2, with k = (kappa - kappa_0) / eta the contraction of
the braid itself. The tube follows the inextensible braid: its stretches are lambda_1 = 1 - k along,
lambda_2 = sqrt((1 - cos^2(alpha0) lambda_1^2) / sin^2(alpha0)) round and, since rubber keeps its
volume, 1 / (lambda_1 lambda_2) through the wall; I1 and I2 are the Mooney-Rivlin invariants. So far
it is the law of Klute and Hannaford (J. Dyn. Syst. Meas. Control 122, 2000, 386-388). Two numbers
are added: kappa_0, because a data sheet's nominal length is not the exact length at which the
rubber is free, and eta, the share of the length that works as an ideal braid, because near its end
fittings a muscle keeps its diameter (Tondu and Lopez, IEEE Control Syst. Mag. 20, 2000, 15-38).

The tube resists as soon as the braid turns and then hardly more, since the hoop stretch, which
stores most of the energy, slows down: this is what measured force maps show. The steep part and the
flat part follow from one geometry, so one can be predicted from the other; in an exponential law
they are unrelated. On the two Festo maps that ship with pamsim c1 comes out negative (c1 + c2, the
stiffness at small strain, positive): c1 and c2 are then constants of the whole wall with its
embedded fibres, not of a rubber, and are not valid beyond the measured contractions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.parameters import ParameterGroup, parameter
from pamsim.physics.braid import volume_gained, volume_slope


@dataclass(frozen=True, kw_only=True)
class MooneyRivlin(ParameterGroup):
    """Wall of the tube, its free length, and the share of it that contracts."""

    group: ClassVar[str] = "force"
    law: ClassVar[str] = "mooney_rivlin"
    scale: float = parameter(
        unit="1", low=0.0, high=5.0, low_open=True, doc="factor on the force", default=1.0
    )
    c1: float = parameter(
        unit="N", low=-1e4, high=1e4, doc="2 C10 times the cross-section of the wall"
    )
    c2: float = parameter(
        unit="N", low=-1e4, high=1e4, doc="2 C01 times the cross-section of the wall"
    )
    # A nominal length is hardly wrong by 5 %. Where lengths are few, a wider range lets a fit trade
    # a free length that nobody would measure for the shape of the wall.
    slack_contraction: float = parameter(
        unit="1", low=-0.05, high=0.05, doc="contraction at which the tube is free", default=0.0
    )
    active_share: float = parameter(
        unit="1", low=0.7, high=1.3, doc="share of the length that works as a braid", default=1.0
    )


def mooney_rivlin_force(
    pressure: float,
    contraction: float,
    c1: float,
    c2: float,
    slack_contraction: float,
    active_share: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Force of a braid over a Mooney-Rivlin tube (Klute and Hannaford 2000, with end effect).

    The arguments are gauge pressure p [Pa], contraction kappa = 1 - l/l0 [-], the fields of
    `MooneyRivlin` after its scale, and diameter D0 [m] and fibre angle alpha0 [rad] of `Braid`.

    Returns:
        Force [N], positive when the muscle pulls; not yet limited to tension. NaN where the braid
        cannot be: stretched until its fibres lie straight, or shorter than nothing.
    """
    braid = (contraction - slack_contraction) / active_share
    wall = _wall_force(braid, c1, c2, fibre_angle)
    return -pressure * volume_slope(1.0 - braid, 1.0, diameter, fibre_angle) - wall


def mooney_rivlin_volume(
    pressure: float,
    contraction: float,
    c1: float,
    c2: float,
    slack_contraction: float,
    active_share: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Volume that belongs to `mooney_rivlin_force`, whose arguments it takes.

    Returns:
        Volume gained since nominal length, per nominal length [m^2]: that of a braid of the active
        share of the length. The wall and the pressure have no influence.
    """
    braid = (contraction - slack_contraction) / active_share
    start = -slack_contraction / active_share
    gained = volume_gained(braid, diameter, fibre_angle)
    return active_share * (gained - volume_gained(start, diameter, fibre_angle))


def mooney_rivlin_elastic_work(
    contraction: float,
    c1: float,
    c2: float,
    slack_contraction: float,
    active_share: float,
    fibre_angle: float,
) -> float:
    """Work of the wall from nominal length on, per nominal length [N]: minus the energy it stores.

    The arguments are those of `mooney_rivlin_force`.
    """
    braid = (contraction - slack_contraction) / active_share
    start = -slack_contraction / active_share
    stored = _wall_energy(braid, c1, c2, fibre_angle) - _wall_energy(start, c1, c2, fibre_angle)
    return -active_share * stored


def _wall_energy(braid: float, c1: float, c2: float, fibre_angle: float) -> float:
    """(c1 I1 + c2 I2) / 2 [N]."""
    along2 = (1.0 - braid) ** 2
    hoop2 = 1.0 + (1.0 - along2) / math.tan(fibre_angle) ** 2
    if along2 <= 0.0 or hoop2 <= 0.0:
        return math.nan
    first = along2 + hoop2 + 1.0 / (along2 * hoop2)
    second = 1.0 / along2 + 1.0 / hoop2 + along2 * hoop2
    return 0.5 * (c1 * first + c2 * second)


def _wall_force(braid: float, c1: float, c2: float, fibre_angle: float) -> float:
    """(c1 dI1/dk + c2 dI2/dk) / 2 [N]: what the wall takes from the pull of the air."""
    cot2 = 1.0 / math.tan(fibre_angle) ** 2
    along = 1.0 - braid
    hoop2 = 1.0 + cot2 * (1.0 - along * along)
    if along <= 0.0 or hoop2 <= 0.0:
        return math.nan
    # d(lambda_1)/dk = -1 and d(lambda_2^2)/dk = 2 turn.
    turn = cot2 * along
    first = turn - along + 1.0 / (along**3 * hoop2) - turn / (along * along * hoop2 * hoop2)
    second = along * along * turn - along * hoop2 + 1.0 / along**3 - turn / (hoop2 * hoop2)
    return c1 * first + c2 * second
