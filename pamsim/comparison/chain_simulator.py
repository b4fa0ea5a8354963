"""A rig simulated link by link with many parameter sets, beside trials that repeat each other.

With the rig as it is, the mean of an input's repeats is simulated in fine time steps. What each
trial with its own measured inputs differs by from it is simulated in longer ones, which misses some
ten-thousandths of the noise's variance. With other parameters the mean is simulated alone, in
coarse steps; the difference between the two at the rig as it is is added to all trials. So noise
that a trial's inputs bring along counts as noise of its residual, and costs one simulation.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from functools import cached_property

import numpy as np

from pamsim.comparison.chain_runs import (
    COARSE,
    MIDDLE,
    OF_REPEATS,
    ChainRuns,
    Residuals,
    Values,
    link_residuals,
    place,
    plain,
)
from pamsim.comparison.link_noise import link_noise
from pamsim.comparison.link_simulation import Signals
from pamsim.comparison.links import VALVES, Link, LinkRun, Runs, joined_runs
from pamsim.comparison.repeats import Repeats
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.inference.blocks import Block
from pamsim.recordings.trial import Trial

_OF_VALVES = frozenset({"valve", "chamber"})
_OF_FORCE_ALONE = frozenset({"creep", "friction", "learned", "joint", "body"})
"""Groups of parameters without influence on pressures along an imposed motion. Those of the active
force have: the volume is its derivative by the pressure (virtual work). So has the stiffness of the
passive one, on which the length of a slack muscle depends."""


class ChainSimulator:
    """Residuals of all links as one vector, simulated minus measured.

    Groups of repeats have channels as the rig names them; other arguments are those of
    `pamsim.comparison.chain_runs.link_residuals`.

    Attributes:
        links: that the trials separate, from the command on.
        blocks: of rows of the residual; units are trials.
        link_of: number of the link of each block.
        repeats: the groups.
        stated: residual of the rig as it is, (n,) [SI].
        noise: of every output of every link.
        not_compared: links of inputs, and why.

    Raises:
        InputError: for a trial that does not fit the rig or does not give its start pressures, no
            channel to compare, or if every simulation breaks down.
    """

    def __init__(
        self,
        rig: Rig,
        groups: Sequence[Repeats],
        *,
        divided: Runs = joined_runs,
        threads: int | None = None,
    ) -> None:
        self.rig, self.repeats = rig, tuple(groups)
        trials = [trial for group in groups for trial in group.trials]
        if not any(divided(rig, trial) for trial in trials):
            raise InputError(
                "no link can be compared: nothing is measured besides inputs of the simulation;"
                " record the angle, pressures or forces as well"
            )
        own, self._of_repeats = _of_trials(rig, trials, divided, threads)
        if not own:
            raise InputError(
                f"{rig.name}: the simulation of every link breaks down; check the rig's parameters"
                " and the units of the recordings"
            )
        self.links = tuple(dict.fromkeys(link for link, _, _ in own))
        self._runs: list[tuple[Repeats, LinkRun]] = []
        driven: list[tuple[Trial, LinkRun]] = []
        broken: list[str] = []
        for group in groups:
            mean = group.mean()
            for run in divided(rig, mean):
                if all((run.link, t.name, c) in own for t in group.trials for c in run.outputs):
                    self._runs.append((group, run))
                    driven.append((mean, run))
                else:
                    broken.append(f"{run.link.name} of {group.name} and its repeats")
        self.not_compared = tuple(f"{which}: a simulation breaks down" for which in broken)
        self._simulator = ChainRuns(rig, driven, threads=threads)
        self._rows = self._places()
        fine, long = self._of_means(1), self._of_means(self._of_repeats)
        self.stated = fine - long
        exact: dict[tuple[Link, str, str], FloatArray] = {}
        for (number, trial, channel), rows in self._rows.items():
            key = self._runs[number][1].link, trial, channel
            self.stated[rows] += own[key]
            exact[key] = self.stated[rows]
        self._corrections = {1: self.stated - fine, self._of_repeats: self.stated - long}
        self.noise = link_noise(rig, trials, exact, divided=divided, threads=threads)
        self.blocks = tuple(
            Block(
                unit=trial,
                channel=channel,
                rows=self._rows[number, trial, channel],
                noise=self.noise[link, channel].noise,
                source=trial,
            )
            for (number, _, _), (link, trial, channel) in zip(self._rows, exact, strict=True)
        )
        self.link_of = tuple(self.links.index(link) for link, _, _ in exact)

    def own_value(self, name: str) -> float:
        """Value of a parameter that the rig states [SI]."""
        return rig_parameter(self.rig, name).value

    def acts_in(self, names: Collection[str]) -> frozenset[Link]:
        """Links whose outputs parameters change."""
        found: set[Link] = set()
        for name in names:
            where, group = place(name), ParameterName.parse(plain(name)).group
            found |= {
                link
                for link in self.links
                if where in ("", link.name)
                and (VALVES in link.parts or group not in _OF_VALVES)
                and (link.parts != (VALVES,) or group not in _OF_FORCE_ALONE)
            }
        return frozenset(found)

    def residuals(
        self,
        sets: Sequence[Values],
        links: Sequence[Collection[Link]],
        others: FloatArray,
        *,
        only: Collection[str] | None = None,
        steps: int = COARSE,
    ) -> list[FloatArray | None]:
        """Residual with each parameter set.

        Args:
            sets: values by name.
            links: of each set, those to simulate.
            others: residual (n,) that the rows of the other links and trials are taken from [SI].
            only: names of groups of repeats to simulate; all if left out.
            steps: fine time steps in one, at most: `COARSE`, `MIDDLE` or 1. Where the rig as it is
                breaks down in so long ones, they are shorter.

        Returns:
            (n,) [SI] for each; None where a value is out of range or a simulation breaks down.
        """
        most = steps if steps <= self._of_repeats else self._most
        found: list[FloatArray | None] = []
        for outputs in self._simulator.simulate(sets, links, only, most):
            if outputs is None:
                found.append(None)
                continue
            residual = others.copy()
            for number, (signals, long) in outputs.items():
                correction = self._correction(long)
                for rows, missed in self._missed(number, signals):
                    residual[rows] = missed + correction[rows]
            found.append(residual)
        return found

    @cached_property
    def _most(self) -> int:
        """Fine time steps in one, at most: in longer ones the rig as it is breaks down."""
        if self._of_repeats < OF_REPEATS:
            return self._of_repeats
        try:
            self._correction(COARSE)
        except InputError:
            return OF_REPEATS
        return COARSE

    def _correction(self, steps: int) -> FloatArray:
        """What means of inputs and long time steps change at the rig as it is, (n,) [SI]."""
        if steps not in self._corrections:
            self._corrections[steps] = self.stated - self._of_means(steps)
        return self._corrections[steps]

    def _of_means(self, steps: int) -> FloatArray:
        """Residual of the rig as it is with the means of inputs, in so long time steps, (n,) [SI].

        Raises:
            InputError: if a link breaks down in them.
        """
        (outputs,) = self._simulator.simulate([{}], [frozenset(self.links)], None, steps)
        if outputs is None:
            step = steps * 1e3 * float(self.rig.model.opt.timestep)
            raise InputError(
                f"{self.rig.name}: a link breaks down in time steps of {step:g} ms; state a shorter"
                " timestep in the rig's file"
            )
        found = np.empty(max(rows.stop for rows in self._rows.values()))
        for number, (signals, _) in outputs.items():
            for rows, missed in self._missed(number, signals):
                found[rows] = missed
        return found

    def _missed(self, number: int, signals: Signals) -> Iterator[tuple[slice, FloatArray]]:
        """Rows of a run's outputs in each of its trials, and signals less what was measured."""
        group, run = self._runs[number]
        for trial in group.trials:
            for channel in run.outputs:
                missed = signals[channel] - trial.measured[channel]
                yield self._rows[number, trial.name, channel], missed

    def _places(self) -> dict[tuple[int, str, str], slice]:
        """Rows of each run, trial and channel."""
        found: dict[tuple[int, str, str], slice] = {}
        end = 0
        for number, (group, run) in enumerate(self._runs):
            for channel in run.outputs:
                for trial in group.trials:
                    found[number, trial.name, channel] = slice(end, end + trial.time.size)
                    end += trial.time.size
        return found


def _of_trials(
    rig: Rig, trials: Sequence[Trial], divided: Runs, threads: int | None
) -> tuple[Residuals, int]:
    """Residuals of the trials with their own inputs, and the fine time steps in one.

    These are the longest in which no run breaks down, of those that what repeats differ by allows.
    """
    outputs = sum(len(run.outputs) for trial in trials for run in divided(rig, trial))
    own: Residuals = {}
    for steps in (OF_REPEATS, MIDDLE, 1):
        own = link_residuals(rig, trials, divided=divided, threads=threads, steps=steps)
        if len(own) == outputs:
            return own, steps
    return own, 1
