"""The force laws a fit knows: those of the catalog, and those the actuator does not run yet."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from pamsim.muscles.catalog import FORCE_LAWS
from pamsim.muscles.force_law import ForceLaw
from pamsim.muscles.mooney_rivlin import (
    MooneyRivlin,
    mooney_rivlin_force,
    mooney_rivlin_force_dkappa,
    mooney_rivlin_force_dp,
    mooney_rivlin_pressure,
)

# The catalog's laws are those the compiled kernel has a branch for. An entry here gives way to the
# catalog's own as soon as there is one.
_FIT_ONLY = (
    ForceLaw(
        title="McKibben muscle with an elastic tube",
        equation="F = -p dV/dl - c1 I1'(k) / 2 - c2 I2'(k) / 2,"
        " k = (kappa - slack_contraction) / active_share",
        source="Klute and Hannaford 2000, with free length and end effect",
        group=MooneyRivlin,
        force_function=mooney_rivlin_force,
        dp_function=mooney_rivlin_force_dp,
        dkappa_function=mooney_rivlin_force_dkappa,
        pressure_function=mooney_rivlin_pressure,
        braid_fields=("diameter", "fibre_angle"),
        pressure_range=(0.0, 6e5),
        limits=lambda coefficients, braid: (0.0, 0.25),  # of Festo's DMSP, by their data sheet
        notes="I1, I2: Mooney-Rivlin invariants of a tube that follows the braid. c1 + c2 is the"
        " stiffness at small strain; either may be negative, as constants of the whole wall. The"
        " scale takes up the difference between inner and working diameter.",
    ),
)

FITTED_LAWS: Mapping[str, ForceLaw] = MappingProxyType(
    {**FORCE_LAWS, **{law.name: law for law in _FIT_ONLY if law.name not in FORCE_LAWS}}
)
"""Every force law that can be fitted, by name."""


def fit_only(name: str) -> bool:
    """Whether a law can be fitted but not yet simulated."""
    return name in FITTED_LAWS and name not in FORCE_LAWS
