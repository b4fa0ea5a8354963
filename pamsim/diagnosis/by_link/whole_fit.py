"""Refit of the effects in the whole chain, which ends a diagnosis and confirms what links show.

What is imposed on a link, smoothed and between samples, is not quite what acted there. It moves
sizes by some per cent: inertia that an independent plant had was found 5 % too small. And it leaves
something in a link even where nothing is missing: of five training cases with the library's own
formula and a remainder by link four left noise alone in the whole chain, of six with another
formula none. The whole chain is driven by commands alone, but any link that misses something spoils
it for all. So it is refitted where every link is left with noise or the families of all effects are
certain. What links have left counts only if the whole chain is left with something as well. If it
is not, a size is that of the whole chain, with an interval that holds the one by link, too.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.links import Link
from pamsim.diagnosis.by_link.judged import Judged
from pamsim.diagnosis.by_link.link_fit import LinkFitter
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.diagnosis.by_link.remainder import Remainder
from pamsim.diagnosis.by_link.sizes import Size, sharpened
from pamsim.diagnosis.by_link.units import Units


def in_whole_chain(
    simulator: ChainSimulator, nuisance: Sequence[str], units: Units, model: LinkModel
) -> tuple[LinkFitter, LinkModel] | None:
    """Fitter of the whole chain and a model refitted there, from its sizes by link.

    None where the simulation of the chain breaks down.
    """
    fitter = LinkFitter(simulator, nuisance, units, short=1)
    # In the order of the effects: that of a set differs from run to run, and with it the rounding.
    begin = {p.name: model.values[p.name] for effect in model.effects for p in effect.parameters}
    fit = fitter.fit(fitter.stated, model.effects, begin, simulator.links)
    return None if fit is None else (fitter, sharpened(fitter, fit))


def left_in_both(
    by_link: Mapping[Link, Remainder], whole: Collection[Remainder]
) -> dict[Link, Remainder]:
    """What every link has left if the whole chain, in any trials, is left with something, too."""
    return {
        link: Remainder(
            excess=min(one.excess, max(other.excess for other in whole)),
            p_value=max(one.p_value, min(other.p_value for other in whole)),
            known=one.known and all(other.known for other in whole),
        )
        for link, one in by_link.items()
    }


def exact_effects(effects: Sequence[Judged]) -> tuple[Judged, ...]:
    """Effects beside which nothing is left after all."""
    return tuple(replace(one, exact=True, named=True, left=0.0, uncounted=0.0) for one in effects)


def confirmed(by_link: Mapping[str, Size], whole: Mapping[str, Size]) -> dict[str, Size]:
    """Sizes of the whole chain, with intervals that hold the values by link, too."""
    found: dict[str, Size] = {}
    for name, size in by_link.items():
        other = whole[name]
        ends = (size.value, *other.interval95)
        found[name] = Size(value=other.value, interval95=(min(ends), max(ends)))
    return found
