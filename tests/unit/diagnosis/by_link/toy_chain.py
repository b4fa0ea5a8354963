"""A chain of two links whose residuals are sums of smooth shapes, one for each parameter."""

from types import SimpleNamespace

import numpy as np
from scipy.signal import lfilter

from pamsim.comparison.chain_runs import plain
from pamsim.comparison.effects_on_rig import candidates
from pamsim.comparison.links import JOINT, MUSCLE, VALVES, Link
from pamsim.core.computation import Steps
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.judge import judge
from pamsim.diagnosis.by_link.limits import USUAL
from pamsim.diagnosis.by_link.link_fit import LinkFitter
from pamsim.diagnosis.by_link.search import search
from pamsim.diagnosis.by_link.units import parts_of_trials, whole_trials
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import load_rig
from pamsim.inference.blocks import Block, correlation_length
from pamsim.inference.coloured_noise import ArNoise, fit_ar_noise

ARM = load_rig("mas20_arm")
AIR, ARMLINK = Link((VALVES,)), Link((MUSCLE, JOINT))
NUISANCE = ("force.scale", "chamber.dead_volume")
GROUPS, TRIALS, ROWS = 8, 3, 80
STEPS = Steps(None, 1)

DRIFT = 30  # correlation time of half of the noise's variance, in samples
VARIES = "passive.stiffness"  # what differs from log to log looks like this


def tried(*names):
    return candidates(ARM, names)[0]


class ToyChain:
    """What a fit needs of a simulator: residual = noise + sum of shapes times parameters' changes.

    Args:
        effects: candidates whose parameters have shapes.
        planted: parameter -> value [SI] of what was measured.
        seed: of the noise.
        same: parameter -> another, whose shape it has.
        bent: share of a further shape in what was measured, as an error of every formula.
    """

    names = tuple(f"t{g}_{k}" for g in range(GROUPS) for k in range(TRIALS))
    rows = ROWS

    def __init__(self, effects, planted=None, *, seed=0, same=None, bent=0.0):
        self.rig, self.links = ARM, (AIR, ARMLINK)
        self._same, self._shapes = same or {}, {}
        own = {p.name: p for e in effects for p in e.parameters}
        self._typical = {
            name: abs(e.probes[0].values[name] - e.neutral.get(name, 0.0)) or 1.0
            for e in effects
            for name in (p.name for p in e.parameters)
        } | {name: rig_parameter(ARM, name).value for name in NUISANCE}
        self._neutral = {name: rig_parameter(ARM, name).value for name in (*own, *NUISANCE)}
        names = {}
        for name in self.names:
            names.setdefault(name.split("_")[0], []).append(name)
        self.repeats = [
            SimpleNamespace(name=own[0], trials=[SimpleNamespace(name=one) for one in own])
            for own in names.values()
        ]
        self.held_out = [name for name in self.names if int(name[1]) % 2]
        blocks, link_of = [], []
        for link in (0, 1):
            for name in self.names:
                start = len(blocks) * self.rows
                rows = slice(start, start + self.rows)
                channel = ("pressure_1", "angle")[link]
                blocks.append(Block(unit=name, channel=channel, rows=rows, noise=self.noise()))
                link_of.append(link)
        self.blocks, self.link_of = tuple(blocks), tuple(link_of)
        self.stated = self._noise(np.random.default_rng(seed)) - self._change(planted or {})
        if bent:
            self.stated -= bent * self._shape("error of the formula", ARMLINK)

    def noise(self):
        """What is known of the noise."""
        return ArNoise((), 1.0)

    def _noise(self, rng):
        return rng.normal(size=len(self.blocks) * self.rows)

    def units(self, limits=USUAL):
        return whole_trials(self, self.held_out, limits=limits)

    def own_value(self, name):
        return rig_parameter(self.rig, name).value

    def acts_in(self, names):
        found = set()
        for name in names:
            own, _, where = name.partition(" in ")
            link = AIR if own.split(".")[0] in ("valve", "chamber") else ARMLINK
            both = own.split(".")[0] in ("sensor", "force")
            found |= {at for at in self.links if (both or at == link) and where in ("", at.name)}
        return frozenset(found)

    def residuals(self, sets, links, others, *, only=None, steps=1):
        found = []
        for values, own in zip(sets, links, strict=True):
            residual = others.copy()
            whole = self.stated + self._change(values)
            for block, link in zip(self.blocks, self.link_of, strict=True):
                group = f"{block.unit.split('_')[0]}_0"
                if self.links[link] in own and (only is None or group in only):
                    residual[block.rows] = whole[block.rows]
            found.append(residual)
        return found

    def _change(self, values):
        total = np.zeros(len(self.blocks) * self.rows)
        for name, value in values.items():
            own = plain(name)
            size = (value - self._neutral[own]) / self._typical[own]
            for link in self.acts_in([name]):
                total += size * self._shape(self._same.get(own, own), link)
        return total

    def _shape(self, name, link):
        if (name, link) not in self._shapes:
            self._shapes[name, link] = self._drawn(name, link)
        return self._shapes[name, link]

    def _drawn(self, name, link):
        """The same in repeats, another in every group and every `ROWS`: three waves."""
        total = np.zeros(len(self.blocks) * self.rows)
        time = np.linspace(0.0, 2.0 * np.pi, ROWS)
        for block, number in zip(self.blocks, self.link_of, strict=True):
            if self.links[number] != link:
                continue
            group = int(block.unit[1 : block.unit.index("_")])
            for start in range(block.rows.start, block.rows.stop, ROWS):
                later = [start - block.rows.start] if start > block.rows.start else []
                rng = np.random.default_rng([*name.encode(), group, number, *later])
                # One sign for all groups in the first wave, as a physical effect has.
                wave = 2.0 * np.sin(time * (1 + len(name) % 3))
                for turns in range(2, 5):
                    wave += rng.normal() * np.sin(turns * time + 7.0 * rng.random())
                total[start : start + ROWS] = wave
        return total


def fitter_of(chain, limits=USUAL):
    return LinkFitter(chain, NUISANCE, chain.units(limits))


def diagnosed(chain, effects, limits=USUAL):
    """Fitter, and what is found: name -> judged effect."""
    fitter = fitter_of(chain, limits)
    searched = search(fitter, effects, steps=STEPS)
    model, found = judge(searched, HeldOut(fitter))
    return fitter, model, {one.effect.name: one for one in found}


def drifting(rng, shape):
    """Noise of variance 1, half of which drifts."""
    keep = np.exp(-1.0 / DRIFT)
    drive = np.sqrt(1.0 - keep**2) * rng.normal(size=shape)
    drive[..., 0] = rng.normal(size=shape[:-1])
    drift = lfilter([1.0], [1.0, -keep], drive)
    return np.sqrt(0.5) * (drift + rng.normal(size=shape))


KNOWN = fit_ar_noise(list(drifting(np.random.default_rng(99), (20, 2000))))
GAP = correlation_length(KNOWN, 2000)


class ToyLog(ToyChain):
    """One log.

    Args:
        variation: size of what differs from log to log, in its standard deviation.
    """

    names = ("t0_0",)
    rows = 24 * ROWS
    white = False  # whether no more of the noise is known than its samples show

    def __init__(self, effects, planted=None, *, variation=0.0, **options):
        super().__init__(effects, planted, **options)
        self.stated += variation * self._varying()[:, 0]

    def noise(self):
        return ArNoise((), KNOWN.variance) if self.white else KNOWN

    def _noise(self, rng):
        return drifting(rng, (len(self.blocks), self.rows)).ravel()

    def _varying(self):
        return 0.5 * self._shape(VARIES, ARMLINK)[:, np.newaxis]

    def units(self, limits=USUAL, *, gap=GAP, assumed=1.0):
        varying = assumed * self._varying()
        return parts_of_trials(self, (), gap=gap, varying=varying, limits=limits)
