"""Whitened rows of two links that are linear in the sizes of effects: fits are exact, and at once.

Every link has `COUNT` rows. The last one holds the noise; anything may be missing in the others.
"""

from types import SimpleNamespace

import numpy as np

from pamsim.core.computation import Steps
from pamsim.diagnosis.by_link.judge import Case
from pamsim.diagnosis.by_link.limits import MATERIAL, USUAL, Difference, Remainder
from pamsim.diagnosis.by_link.link_fit import LinkFitter, LinkModel
from pamsim.diagnosis.by_link.promise import Signature
from pamsim.diagnosis.by_link.search import Searched, Tried
from tests.unit.diagnosis.by_link.toy_chain import AIR, ARMLINK

COUNT = 8


def rows(**mean_squares):
    """Rows by their share of the mean square of a link: ``air_0=2.0`` is the first of the air's."""
    found = np.zeros(2 * COUNT)
    for place, square in mean_squares.items():
        link, _, number = place.partition("_")
        at = int(number) + COUNT * (link == "arm")
        found[at] = np.sign(square) * np.sqrt(COUNT * abs(square))
    return found


class LinearFitter:
    """Fits of effects of one number each.

    Args:
        shapes: (effect, change of the rows with it at its probe) of all that is tried.
        missing: rows of what the rig is missing.
        numbers: nuisance parameter of the air -> (its value, change of the rows when it doubles).
    """

    by_link, shown_in, in_links = LinkFitter.by_link, LinkFitter.shown_in, LinkFitter.in_links

    def __init__(self, shapes, missing, numbers):
        self.simulator = SimpleNamespace(links=(AIR, ARMLINK), acts_in=lambda names: {AIR})
        self.link_of = np.repeat([0, 1], COUNT)
        fitted = SimpleNamespace(link_of=self.link_of, group_of=0 * self.link_of)
        judged = SimpleNamespace(blocks=(1,))
        self.units = SimpleNamespace(judged=judged, fitted=fitted, limits=USUAL)
        self.counts = np.full(2, float(COUNT))
        self.material = MATERIAL * self.counts
        noise = rows(**{f"{link}_{COUNT - 1}": 1.0 for link in ("air", "arm")})
        self._rows, self._tried, self._numbers = noise - missing, shapes, numbers
        self._shapes = {one.label: own for one, own in shapes}
        self.nuisance = {name: value for name, (value, _) in numbers.items()}
        self.stated = self.fit(None, (), {}, ())

    def fit(self, begin, effects, start, links):
        shapes = {name: own for name, (_, own) in self._numbers.items()}
        shapes |= {one.parameters[0].name: self._shapes[one.label] for one in effects}
        columns = np.array(list(shapes.values())).reshape(len(shapes), self._rows.size).T
        sizes = np.linalg.lstsq(columns, -self._rows, rcond=None)[0]
        of = dict(zip(shapes, sizes.tolist(), strict=True))
        values = {name: (1.0 + of[name]) * value for name, value in self.nuisance.items()}
        for one in effects:
            values |= one.moved(one.probes[0], of[one.parameters[0].name])
        return LinkModel(
            effects=tuple(effects),
            values=values,
            residual=self._rows,
            offset=0.0 * self._rows,
            rows=self._rows + columns @ sizes,
            sensitivities=shapes,
        )

    def simulate(self, sets, links, about):
        found = []
        for values in sets:
            sizes = [(values[n] / value - 1.0, own) for n, (value, own) in self._numbers.items()]
            for one, own in self._tried:
                name = one.parameters[0].name
                probe, gone = one.probes[0].values[name], one.neutral.get(name, 0.0)
                sizes.append(((values.get(name, gone) - gone) / (probe - gone), own))
            found.append(self._rows + sum(size * own for size, own in sizes))
        return found

    def whiten(self, residual):
        return residual

    def everywhere(self, model):
        return model


class Shown:
    """Judges by the rows that are fitted; what takes away `LITTLE` or less may be noise.

    Args:
        p_value: of what is left.
    """

    LITTLE = 0.1

    def __init__(self, fitter, p_value):
        self._fitter, self._p_value = fitter, p_value

    def losses(self, model):
        links = self._fitter.simulator.links
        return {link: model.rows[self._fitter.in_links({link})] ** 2 for link in links}

    def beyond_noise(self, model):
        return {link: float(np.mean(loss)) - 1.0 for link, loss in self.losses(model).items()}

    def remainders(self, model):
        left = self.beyond_noise(model).items()
        return {link: Remainder(excess=size, p_value=self._p_value) for link, size in left}

    def better(self, model, rest, links):
        own, other = self.losses(model), self.losses(rest)
        gain = float(np.mean([np.mean(other[link]) - np.mean(own[link]) for link in links]))
        return Difference(gain=gain, p_value=0.001 if gain > self.LITTLE else 0.5)

    def worse(self, rival, model, rest, links):
        return self.better(model, rival, links)


def judgement(shapes, missing, *effects, p_value=0.001, numbers=None):
    """A case, what a search has found that ends with some effects, and labels of fits begun later.

    See `LinearFitter` and `Shown` for the arguments.
    """
    fitter, begun = LinearFitter(shapes, missing, numbers or {}), []
    known = [Signature(effect=one, probe=one.probes[0], rows=own) for one, own in shapes]
    tried = Tried(fitter, Steps(lambda done, most, what: begun.append(what), 1), known)
    unseen = Shown(fitter, p_value)
    case = Case(tried, unseen, unseen.beyond_noise(fitter.stated))
    model = fitter.fit(None, effects, {}, ())
    return case, Searched(base=fitter.stated, model=model, tried=tried), begun
