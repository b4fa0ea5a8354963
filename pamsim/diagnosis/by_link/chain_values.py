"""One value of every parameter for the whole chain, from those that each link has of its own."""

from __future__ import annotations

import numpy as np

from pamsim.comparison.chain_runs import in_link, plain
from pamsim.comparison.links import JOINT, MUSCLE, PARTS, VALVES, Link
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.effects.effect import LINK_OF_GROUP
from pamsim.engine.parameter_names import ParameterName

_PARTS = {"air": (VALVES,), "transmission": (JOINT,), "joint": (JOINT,), "sensor": PARTS}
"""Link that a group of parameters acts in -> parts of the chain; other groups are of muscles."""


def chain_values(found: LinkDiagnosis, model: LinkModel) -> dict[str, float]:
    """Values of the rig's parameters in a model of a diagnosis, with its effects or others [SI].

    Where the diagnosis has refitted its model in the whole chain, these are its values. Else a
    nuisance parameter has the value of the link that its part of the chain lies in. In others it
    has little influence, and makes up for what is missing there. Of several such links it has the
    mean, weighted by how well each shows it: by the sum of squares of its sensitivities.
    """
    if model is found.model and found.whole is not None:
        return {plain(name): value for name, value in found.whole.values.items()}
    values = {name: value for name, value in model.values.items() if plain(name) == name}
    nuisance = dict.fromkeys(plain(name) for name in model.values if plain(name) != name)
    for name in nuisance:
        link = LINK_OF_GROUP.get(ParameterName.parse(name).group, "muscle")
        parts = _PARTS.get(link, (MUSCLE,))
        known = link_values(found, model, name)
        own = [one for one in known if set(parts) & set(one.parts)] or list(known)
        weights = [_shown(_fitted_in(found, model, one), in_link(name, one)) for one in own]
        each = [known[one] for one in own]
        values[name] = float(np.average(each, weights=weights if any(weights) else None))
    return values


def link_values(found: LinkDiagnosis, model: LinkModel, name: str) -> dict[Link, float]:
    """Values of a nuisance parameter in the links of a model that it acts in [SI]."""
    return {
        link: _fitted_in(found, model, link).values[in_link(name, link)]
        for link in found.links
        if in_link(name, link) in model.values
    }


def _fitted_in(found: LinkDiagnosis, model: LinkModel, link: Link) -> LinkModel:
    """The model, or another one where that has left a link as the rig states it."""
    shape = found.shape
    if shape is not None and model is shape.model:
        return model if link in shape.links else found.model
    return model if any(link in one.links for one in found.effects) else found.base


def _shown(model: LinkModel, name: str) -> float:
    column = model.sensitivities.get(name)
    return 0.0 if column is None else float(column @ column)
