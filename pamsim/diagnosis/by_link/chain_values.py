"""One value of every parameter for the whole chain, from those that each link has of its own."""

from __future__ import annotations

import numpy as np

from pamsim.comparison.chain_simulator import in_link, plain
from pamsim.comparison.links import JOINT, MUSCLE, PARTS, VALVES
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis
from pamsim.diagnosis.by_link.link_fit import LinkModel
from pamsim.engine.parameter_names import ParameterName

_PARTS = {
    "valve": (VALVES,),
    "chamber": (VALVES,),
    "chain": (JOINT,),
    "tendon": (JOINT,),
    "friction": (JOINT,),
    "joint": (JOINT,),
    "body": (JOINT,),
    "sensor": PARTS,
}
"""Group of parameters -> parts of the chain that it is of; those of other groups are of muscles."""


def chain_values(found: LinkDiagnosis, model: LinkModel) -> dict[str, float]:
    """Values of the rig's parameters in a model of a diagnosis [SI].

    A nuisance parameter has the value of the link that its part of the chain lies in. In others it
    has little influence, and makes up for what is missing there. Of several such links it has the
    mean, weighted by how well each shows it: by the sum of squares of its sensitivities.

    Args:
        found: the diagnosis.
        model: with its effects, with a rival in the place of one, or without any.
    """
    fitted = {link for one in found.effects for link in one.links}
    values = {name: value for name, value in model.values.items() if plain(name) == name}
    nuisance = dict.fromkeys(plain(name) for name in model.values if plain(name) != name)
    for name in nuisance:
        parts = _PARTS.get(ParameterName.parse(name).group, (MUSCLE,))
        known = [link for link in found.links if in_link(name, link) in model.values]
        own = [link for link in known if set(parts) & set(link.parts)] or known
        # The model has left links without an effect as the rig states them.
        states = [(model if link in fitted else found.base, in_link(name, link)) for link in own]
        each = [one.values[local] for one, local in states]
        weights = [_shown(one, local) for one, local in states]
        values[name] = float(np.average(each, weights=weights if any(weights) else None))
    return values


def _shown(model: LinkModel, name: str) -> float:
    column = model.sensitivities.get(name)
    return 0.0 if column is None else float(column @ column)
