"""One value of every parameter for the whole chain, from those that each link has of its own."""

from __future__ import annotations

import numpy as np

from pamsim.comparison.chain_simulator import plain
from pamsim.diagnosis.by_link.link_fit import LinkModel


def chain_values(model: LinkModel) -> dict[str, float]:
    """Values of the rig's parameters in a fitted model [SI].

    A nuisance parameter has the mean of its links, weighted by how well each shows it: by the sum
    of squares of its sensitivities. To first order that is a fit to the rows of all links.

    Args:
        model: fitted.
    """
    found: dict[str, list[tuple[float, float]]] = {}
    for name, value in model.values.items():
        shown = model.sensitivities.get(name, np.zeros(1))
        found.setdefault(plain(name), []).append((value, float(shown @ shown)))
    values: dict[str, float] = {}
    for name, own in found.items():
        each, weights = np.array(own).T
        values[name] = float(np.average(each, weights=weights if weights.any() else None))
    return values
