"""Refit of the effects in the whole chain, which ends a diagnosis and confirms their sizes.

What is imposed on a link, smoothed and between samples, is not quite what acted there, and moves
sizes by some per cent: inertia that an independent plant had was found 5 % too small. The whole
chain is driven by commands alone, but any link that misses something spoils it for all. So it is
refitted where every link is left with noise; a size is then its, and its interval holds both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.short_steps import sharpened
from pamsim.diagnosis.by_link.sizes import Size
from pamsim.diagnosis.by_link.units import Units


def in_whole_chain(
    simulator: ChainSimulator, nuisance: Sequence[str], units: Units, model: LinkModel
) -> tuple[LinkFitter, LinkModel] | None:
    """Refit a model's effects, from their sizes by link.

    Args:
        simulator: of the whole chain.
        nuisance: rig parameters that are refitted.
        units: of it.
        model: as fitted to the links.

    Returns:
        The fitter and the model; None where its simulation breaks down.
    """
    fitter = LinkFitter(simulator, nuisance, units, short=1)
    begin = {name: model.values[name] for name in model.freed}
    fit = fitter.fit(fitter.stated, model.effects, begin, simulator.links)
    return None if fit is None else (fitter, sharpened(fitter, fit))


def confirmed(by_link: Mapping[str, Size], whole: Mapping[str, Size]) -> dict[str, Size]:
    """Sizes of the whole chain, with intervals that hold those by link, too."""
    found: dict[str, Size] = {}
    for name, size in by_link.items():
        other = whole[name]
        ends = (*size.interval95, *other.interval95)
        found[name] = Size(
            value=other.value,
            interval95=(min(ends), max(ends)),
            by_inputs=size.by_inputs or other.by_inputs,
        )
    return found
