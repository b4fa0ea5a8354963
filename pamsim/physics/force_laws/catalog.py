"""Every force law: its card under one signature."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pamsim.core.catalog import Catalog
from pamsim.physics.braid import Braid, max_contraction
from pamsim.physics.force_laws.corrected_mckibben import (
    VALID_FROM,
    CorrectedMcKibben,
    corrected_mckibben_force,
    corrected_mckibben_volume,
    corrected_mckibben_work,
)
from pamsim.physics.force_laws.effective_area import (
    EffectiveArea,
    effective_area_elastic_work,
    effective_area_force,
    effective_area_volume,
)
from pamsim.physics.force_laws.elastic_energy import (
    ElasticEnergy,
    elastic_energy_force,
    elastic_energy_volume,
    elastic_energy_work,
)
from pamsim.physics.force_laws.exponential import (
    SixParameter,
    six_parameter_derivatives,
    six_parameter_elastic_work,
    six_parameter_force,
    six_parameter_volume,
)
from pamsim.physics.force_laws.force_law import ForceLaw, Range
from pamsim.physics.force_laws.invertible_exponential import (
    InvertibleExponential,
    invertible_exponential_elastic_work,
    invertible_exponential_force,
    invertible_exponential_volume,
)
from pamsim.physics.force_laws.mckibben import (
    IdealMcKibben,
    ideal_tension,
    ideal_volume,
)
from pamsim.physics.force_laws.mooney_rivlin import (
    MooneyRivlin,
    mooney_rivlin_elastic_work,
    mooney_rivlin_force,
    mooney_rivlin_volume,
)
from pamsim.physics.force_laws.pleated import (
    FIT_RANGE,
    Pleated,
    pleated_force,
    pleated_volume,
)
from pamsim.physics.force_laws.pleated_shape import (
    PleatedShape,
    pleated_max_contraction,
    pleated_shape_force,
    pleated_shape_volume,
)
from pamsim.physics.force_laws.single_pressure_exponential import (
    SinglePressureExponential,
    single_pressure_force,
    single_pressure_volume,
    single_pressure_work,
)


def _festo(coefficients: Sequence[float], braid: Braid) -> Range:
    """Contraction of Festo's DMSP muscles: at most 25 % by data sheet (Nguyen 2024, Sarosi)."""
    return 0.0, 0.25


def _to_largest(coefficients: Sequence[float], braid: Braid) -> Range:
    """Up to the contraction at which the ideal braid stops pulling."""
    return 0.0, max_contraction(braid.fibre_angle)


def _half_stroke(coefficients: Sequence[float], braid: Braid) -> Range:
    """Strokes about that at which the spring is free, up to half of it compressed or stretched."""
    return -0.5, 0.5


def _fitted(coefficients: Sequence[float], braid: Braid) -> Range:
    """The range in which the coefficients of a pleated muscle are fitted."""
    return FIT_RANGE


def _pleated_to_largest(coefficients: Sequence[float], braid: Braid) -> Range:
    """From where the fibres no longer stretch to where the pull of a pleated muscle ends."""
    return FIT_RANGE[0], pleated_max_contraction(coefficients[1])


_FESTO_PRESSURES: Range = (0.0, 6e5)
_PLEATED_PRESSURES: Range = (1e5, 2.5e5)

_LAWS: tuple[ForceLaw, ...] = (
    ForceLaw(
        title="Ideal McKibben muscle",
        equation="F = p pi r0^2 (3 (1 - kappa)^2 / tan^2(alpha0) - 1 / sin^2(alpha0)) = -p dV/dl",
        source="Sarosi, equation (1); Matiskova 2021, equation (3)",
        group=IdealMcKibben,
        force_function=ideal_tension,
        volume_function=ideal_volume,
        volume_varies=False,
        braid_fields=("nominal_length", "diameter", "fibre_angle"),
        pressure_range=(0.0, math.inf),
        limits=_to_largest,
        notes="Virtual work alone: no rubber, no end caps, the same largest contraction at every"
        " pressure. Overestimates the pull of a real muscle.",
    ),
    ForceLaw(
        title="Six-parameter exponential",
        equation="F = (a p + b) exp(c kappa) + d p kappa + e p + f",
        source="Sarosi, equation (4) with its d and f zero; inverse (5)",
        group=SixParameter,
        force_function=six_parameter_force,
        volume_function=six_parameter_volume,
        work_function=six_parameter_elastic_work,
        derivatives_function=six_parameter_derivatives,
        volume_varies=False,
        pressure_range=_FESTO_PRESSURES,
        limits=_festo,
        notes="A fit to Festo DMSP muscles; constants in published.py. exp(c kappa)"
        " grows steeply for a stretched muscle, kappa < 0, where nothing was measured.",
    ),
    ForceLaw(
        title="McKibben muscle with two corrections",
        equation="F = mu p pi r0^2 (a (1 - eps kappa)^2 - b), a = 3 / tan^2(alpha0),"
        " b = 1 / sin^2(alpha0), eps = a_eps exp(-p/bar) - b_eps,"
        " mu = a_kappa exp(-k0 kappa) - b_kappa",
        source="Sarosi, equation (2)",
        group=CorrectedMcKibben,
        force_function=corrected_mckibben_force,
        volume_function=corrected_mckibben_volume,
        work_function=corrected_mckibben_work,
        braid_fields=("diameter", "fibre_angle"),
        pressure_range=(VALID_FROM, _FESTO_PRESSURES[1]),
        limits=_festo,
        notes="Vouched for from 2 bar on. The inverse is unique above the threshold pressure if"
        " a_eps kappa >= 0 and NaN otherwise. scale and the pair (a_kappa, b_kappa) multiply the"
        " same force: fit one or the other. The volume changes with pressure at a held"
        " length; below 2 bar it is that at 2 bar, so force and volume do not do the same work.",
    ),
    ForceLaw(
        title="Exponential at one pressure",
        equation="F = a exp(b kappa) + d kappa + e",
        source="Sarosi, equation (3) with its c folded into a",
        group=SinglePressureExponential,
        force_function=single_pressure_force,
        volume_function=single_pressure_volume,
        work_function=single_pressure_work,
        volume_varies=False,
        pressure_range=None,
        limits=_festo,
        notes="One isobar: the force does not change with pressure, so the law fits a force map at"
        " one pressure and must not drive a muscle whose pressure changes.",
    ),
    ForceLaw(
        title="Invertible exponential",
        equation="F = (a p + b) exp(c kappa) + (e p + f) kappa + g p + h",
        source="Sarosi, equation (4) with its d folded into a and b; inverse (5)",
        group=InvertibleExponential,
        force_function=invertible_exponential_force,
        volume_function=invertible_exponential_volume,
        work_function=invertible_exponential_elastic_work,
        volume_varies=False,
        pressure_range=_FESTO_PRESSURES,
        limits=_festo,
        notes="The six-parameter law and one term more, f kappa. No constants are published.",
    ),
    ForceLaw(
        title="Restoring force of the air",
        equation="F = -p dV/dl + p1 dV/dl(l1)",
        source="Nguyen 2024, equations (3) and (5), signs by virtual work",
        group=ElasticEnergy,
        force_function=elastic_energy_force,
        volume_function=elastic_energy_volume,
        work_function=elastic_energy_work,
        volume_varies=False,
        braid_fields=("diameter", "fibre_angle"),
        pressure_range=(0.0, math.inf),
        limits=_to_largest,
        notes="Counts from a working point and is zero there: without the load carried at that"
        " point it is not the tension of the muscle, and a limit to tension would cut half of it.",
    ),
    ForceLaw(
        title="Pleated muscle, fitted force function",
        equation="F = p l0^2 (f0 / eps + f1 + f2 eps + f3 eps^2 + f4 eps^3)",
        source="Van Damme 2008, equations (1) and (2)",
        group=Pleated,
        force_function=pleated_force,
        volume_function=pleated_volume,
        volume_varies=False,
        braid_fields=("nominal_length",),
        pressure_range=_PLEATED_PRESSURES,
        limits=_fitted,
        notes="NaN at and below zero contraction, too large below 5 %. Coefficients for l0/R = 6 in"
        " pleated.py. Leave braid.extensibility 0. The braid's diameter is that of the"
        " end discs: its cylinder is the volume at nominal length.",
    ),
    ForceLaw(
        title="Pleated muscle, exact shape for many fibres",
        equation="F = p l0^2 pi (1 - 2 m) / (2 F(a|m)^2), l0/R = F(a|m) / (sqrt(m) cos(a)),"
        " eps = 2 (1 - E(a|m) / F(a|m))",
        source="Van Damme 2008, equation (1), derived from zero hoop stress",
        group=PleatedShape,
        force_function=pleated_shape_force,
        volume_function=pleated_shape_volume,
        volume_varies=False,
        braid_fields=("nominal_length",),
        pressure_range=_PLEATED_PRESSURES,
        limits=_pleated_to_largest,
        notes="The limit of many fibres: Van Damme 2008 measures less with 25 fibres than with 40."
        " NaN at and below zero contraction; leave braid.extensibility 0. Its cylinder at nominal"
        " length is the braid's: give it the diameter 2 R of the end discs.",
    ),
    ForceLaw(
        title="McKibben muscle with an elastic tube",
        equation="F = -p dV/dl - c1 I1'(k) / 2 - c2 I2'(k) / 2,"
        " k = (kappa - slack_contraction) / active_share",
        source="Klute and Hannaford 2000, with free length and end effect",
        group=MooneyRivlin,
        force_function=mooney_rivlin_force,
        volume_function=mooney_rivlin_volume,
        work_function=mooney_rivlin_elastic_work,
        volume_varies=False,
        braid_fields=("diameter", "fibre_angle"),
        pressure_range=_FESTO_PRESSURES,
        limits=_festo,
        notes="I1, I2: Mooney-Rivlin invariants of a tube that follows the braid. c1 + c2 is the"
        " stiffness at small strain; either may be negative, as constants of the whole wall. The"
        " scale takes up the difference between inner and working diameter.",
    ),
    ForceLaw(
        title="Bellows or piston",
        equation="F = -p A + k (s - s0), kappa = 1 - s/s0",
        source="ISO 5598 (2020), effective area; EquiMus (2025)",
        group=EffectiveArea,
        force_function=effective_area_force,
        volume_function=effective_area_volume,
        work_function=effective_area_elastic_work,
        volume_varies=False,
        braid_fields=("nominal_length",),
        pressure_range=(0.0, math.inf),
        limits=_half_stroke,
        pushes=True,
        notes="Pushes: its force is negative. The group stroke takes the place of braid; passive,"
        " threshold, end_shape and chain have no meaning for it. The effective area of a real"
        " bellows falls somewhat with the stroke.",
    ),
)

FORCE_LAWS = Catalog(ForceLaw, _LAWS, slot="force.law")
"""Every force law by its name."""
