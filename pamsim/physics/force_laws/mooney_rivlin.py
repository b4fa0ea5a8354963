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
flat part follow from one geometry; in an exponential law they are unrelated. On the two Festo maps
that ship with pamsim c1 comes out negative (c1 + c2, the stiffness at small strain, positive): c1
and c2 are then constants of the whole wall with its embedded fibres, not of a rubber, and are not
valid beyond the measured contractions.
"""

from __future__ import annotations

import math

from pamsim.core.parameters import quantity
from pamsim.physics.braid import volume_gained, volume_slope
from pamsim.physics.force_laws.force_law import FESTO_PRESSURES, ForceLaw, ForceParameters


class MooneyRivlin(ForceParameters, law="mooney_rivlin"):
    """Wall of the tube, its free length, and the share of it that contracts."""

    c1: float = quantity("[-1e4, 1e4] N", "2 C10 times the cross-section of the wall")
    c2: float = quantity("[-1e4, 1e4] N", "2 C01 times the cross-section of the wall")
    # A nominal length is hardly wrong by 5 %. Where lengths are few, a wider range lets a fit trade
    # a free length that nobody would measure for the shape of the wall.
    slack_contraction: float = quantity(
        "[-0.05, 0.05]", "contraction at which the tube is free", 0.0
    )
    active_share: float = quantity("[0.7, 1.3]", "share of the length that works as a braid", 1.0)


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
    """Force [N] of a braid over a Mooney-Rivlin tube, not limited to tension.

    The arguments are gauge pressure p [Pa], contraction kappa [-], the fields of the group, and D0
    [m] and alpha0 [rad] of `Braid`. NaN where the braid cannot be: stretched until its fibres lie
    straight, or shorter than nothing.
    """
    braid = (contraction - slack_contraction) / active_share
    _, wall = _wall(braid, c1, c2, fibre_angle)
    return -pressure * volume_slope(1.0 - braid, 1.0, diameter, fibre_angle) - wall


def mooney_rivlin_volume(
    contraction: float,
    slack_contraction: float,
    active_share: float,
    diameter: float,
    fibre_angle: float,
) -> float:
    """Volume gained since nominal length, per nominal length [m^2]: the braid's share."""
    braid = (contraction - slack_contraction) / active_share
    start = -slack_contraction / active_share
    gained = volume_gained(braid, diameter, fibre_angle)
    return active_share * (gained - volume_gained(start, diameter, fibre_angle))


def mooney_rivlin_work(
    contraction: float,
    c1: float,
    c2: float,
    slack_contraction: float,
    active_share: float,
    fibre_angle: float,
) -> float:
    """Work of the wall from nominal length on, per nominal length [N]: minus its energy."""
    stored, _ = _wall((contraction - slack_contraction) / active_share, c1, c2, fibre_angle)
    start, _ = _wall(-slack_contraction / active_share, c1, c2, fibre_angle)
    return -active_share * (stored - start)


def _wall(braid: float, c1: float, c2: float, fibre_angle: float) -> tuple[float, float]:
    """(c1 I1 + c2 I2) / 2 and its derivative by k [N], what the wall takes from the pull."""
    cot2 = 1.0 / math.tan(fibre_angle) ** 2
    along = 1.0 - braid
    along2 = along * along
    hoop2 = 1.0 + cot2 * (1.0 - along2)
    if along <= 0.0 or hoop2 <= 0.0:
        return math.nan, math.nan
    first = along2 + hoop2 + 1.0 / (along2 * hoop2)
    second = 1.0 / along2 + 1.0 / hoop2 + along2 * hoop2
    energy = 0.5 * (c1 * first + c2 * second)
    # d(lambda_1)/dk = -1 and d(lambda_2^2)/dk = 2 turn.
    turn = cot2 * along
    first = turn - along + 1.0 / (along**3 * hoop2) - turn / (along2 * hoop2 * hoop2)
    second = along2 * turn - along * hoop2 + 1.0 / along**3 - turn / (hoop2 * hoop2)
    return energy, c1 * first + c2 * second


CARD = ForceLaw(
    title="McKibben muscle with an elastic tube",
    equation="F = -p dV/dl - c1 I1'(k) / 2 - c2 I2'(k) / 2,"
    " k = (kappa - slack_contraction) / active_share",
    source="Klute and Hannaford 2000, with free length and end effect",
    group=MooneyRivlin,
    force_function=mooney_rivlin_force,
    volume_function=mooney_rivlin_volume,
    work_function=mooney_rivlin_work,
    volume_varies=False,
    braid_fields=("diameter", "fibre_angle"),
    pressure_range=FESTO_PRESSURES,
    notes="I1, I2: Mooney-Rivlin invariants of a tube that follows the braid. c1 + c2 is the"
    " stiffness at small strain; either may be negative, as constants of the whole wall. The"
    " scale takes up the difference between inner and working diameter.",
)
