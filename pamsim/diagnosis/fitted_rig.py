"""A rig with fitted parameters.

The radius of all tendons' pulleys (sprockets) is one nuisance parameter of tables at rest.
"""

from __future__ import annotations

from collections.abc import Mapping

from pamsim.core.errors import InputError
from pamsim.engine.parameters import RigParameter, each_muscle, rig_parameter
from pamsim.engine.rig import Rig

PULLEY = "pulley radius"
"""Its name among fitted parameters."""


def pulleys(rig: Rig) -> list[str]:
    """Names of the parameters that hold the radii of the tendons' pulleys."""
    return [n for n in rig.file.native if n.startswith("tendon.") and n.endswith(".coef")]


def stated(rig: Rig, name: str) -> RigParameter:
    """A parameter as a rig states it; of ``pulley radius``, the radius of its first pulley.

    Raises:
        InputError: for a name that the rig does not have, or if it states no pulley.
    """
    if name != PULLEY:
        return rig_parameter(rig, name)
    if not pulleys(rig):
        raise InputError(f"{rig.name} states no pulley (tendon.NAME.coef); leave out {PULLEY!r}")
    return rig_parameter(rig, pulleys(rig)[0])


def with_fitted(rig: Rig, values: Mapping[str, float]) -> Rig:
    """The rig with fitted parameters, name -> value [SI], `PULLEY` perhaps among them.

    Radii that differ keep their ratio, as do numbers in which muscles differ (`each_muscle`).

    Raises:
        ParameterError: for a value outside its range.
    """
    named = {name: value for name, value in values.items() if name != PULLEY}
    if PULLEY in values:
        radii = {name: rig_parameter(rig, name).value for name in pulleys(rig)}
        first = stated(rig, PULLEY).value
        named |= {name: values[PULLEY] * (radius / first) for name, radius in radii.items()}
    return rig.with_parameters(each_muscle(rig, named))


def possible_rig(rig: Rig, values: Mapping[str, float]) -> Rig | None:
    """As `with_fitted`; None where a value lies at an open end of its range."""
    try:
        return with_fitted(rig, values)
    except InputError:
        return None
