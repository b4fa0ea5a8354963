"""A rig simulated link by link with many parameter sets, beside trials that repeat each other.

With the rig as it is, every trial is simulated with its own measured inputs, in fine time steps.
With other parameters the repeats of an input are simulated once, with the mean of their inputs and
in coarse steps; the difference between the two at the rig as it is is added to all of them. So
noise that a trial's inputs bring along counts as noise of its residual, and costs one simulation.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from pamsim.comparison.chain_runs import COARSE, ChainRuns, Values, link_residuals, place, plain
from pamsim.comparison.link_noise import link_noise
from pamsim.comparison.links import VALVES, Link, Runs, joined_runs
from pamsim.comparison.repeats import Repeats
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.inference.blocks import Block

_OF_VALVES = frozenset({"valve", "chamber"})
_OF_FORCE_ALONE = frozenset({"creep", "friction", "learned", "joint", "body"})
"""Groups of parameters without influence on pressures along an imposed motion. Those of the active
force have: the volume is its derivative by the pressure (virtual work). So has the stiffness of the
passive one, on which the length of a slack muscle depends."""


class ChainSimulator:
    """Residuals of all links as one vector, simulated minus measured.

    Args:
        rig: as it is.
        groups: repeats, with channels as the rig names them.
        divided: into which links.
        threads: simulations at a time; None for one per processor.

    Attributes:
        links: that the trials separate, from the command on.
        blocks: of rows of the residual; units are trials.
        link_of: number of the link of each block.
        repeats: the groups.
        stated: residual of the rig as it is, (n,) [SI].
        noise: of every output of every link.

    Raises:
        InputError: for a trial that does not fit the rig or does not give its start pressures, or
            no channel to compare.
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
        exact = {
            (link, block.trial, block.channel): block.residual
            for link, blocks in link_residuals(
                rig, trials, divided=divided, threads=threads
            ).items()
            for block in blocks
        }
        if not exact:
            raise InputError("no link can be compared: nothing is measured that drives nothing")
        self.links = tuple(dict.fromkeys(link for link, _, _ in exact))
        driven = [
            (group, mean, run)
            for group, mean in ((group, group.mean()) for group in groups)
            for run in divided(rig, mean)
            if all((run.link, t.name, c) in exact for t in group.trials for c in run.outputs)
        ]
        self._runs = [(group, run) for group, _, run in driven]
        means = [(mean, run) for _, mean, run in driven]
        self._simulator = ChainRuns(rig, means, threads=threads)
        self.noise = link_noise(rig, trials, exact, divided=divided, threads=threads)
        self.blocks, self.link_of = self._blocks()
        rows = {
            (link, b.unit, b.channel): b.rows
            for link, b in zip((self.links[i] for i in self.link_of), self.blocks, strict=True)
        }
        size = self.blocks[-1].rows.stop
        self.stated = np.empty(size)
        for key, where in rows.items():
            self.stated[where] = exact[key]
        self._corrections: dict[int, FloatArray] = {}

    def own_value(self, name: str) -> float:
        """Value of a parameter that the rig states [SI]."""
        return rig_parameter(self.rig, name).value

    def acts_in(self, names: Collection[str]) -> frozenset[Link]:
        """Links whose outputs parameters change."""
        found: set[Link] = set()
        for name in names:
            where, group = place(name), ParameterName.parse(plain(name)).group
            for link in self.links:
                if where and link.name != where:
                    continue
                valves = VALVES in link.parts
                if (valves or group not in _OF_VALVES) and (
                    link.parts != (VALVES,) or group not in _OF_FORCE_ALONE
                ):
                    found.add(link)
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
            steps: fine time steps in one, at most: `COARSE`, `MIDDLE` or 1.

        Returns:
            (n,) [SI] for each; None where a value is out of range or a simulation breaks down.
        """
        found: list[FloatArray | None] = []
        for outputs in self._simulator.simulate(sets, links, only, steps):
            if outputs is None:
                found.append(None)
                continue
            residual = others.copy()
            for number, (signals, long) in outputs.items():
                group, run = self._runs[number]
                for trial in group.trials:
                    for channel in run.outputs:
                        rows = self._rows[number, trial.name, channel]
                        missed = signals[channel] - trial.measured[channel]
                        residual[rows] = missed + self._correction(long)[rows]
            found.append(residual)
        return found

    def _correction(self, steps: int) -> FloatArray:
        """What means of inputs and long time steps change at the rig as it is, (n,) [SI]."""
        if steps not in self._corrections:
            self._corrections[steps] = np.zeros_like(self.stated)
            (means,) = self.residuals([{}], [frozenset(self.links)], self.stated, steps=steps)
            if means is None:
                raise InputError(f"{self.rig.name}: a link breaks down in coarse time steps")
            self._corrections[steps] = self.stated - means
        return self._corrections[steps]

    def _blocks(self) -> tuple[tuple[Block, ...], tuple[int, ...]]:
        blocks: list[Block] = []
        link_of: list[int] = []
        self._rows: dict[tuple[int, str, str], slice] = {}
        end = 0
        for number, (group, run) in enumerate(self._runs):
            for channel in run.outputs:
                for trial in group.trials:
                    rows = slice(end, end + trial.time.size)
                    end = rows.stop
                    self._rows[number, trial.name, channel] = rows
                    blocks.append(
                        Block(
                            unit=trial.name,
                            channel=channel,
                            rows=rows,
                            noise=self.noise[run.link, channel].noise,
                            source=trial.name,
                        )
                    )
                    link_of.append(self.links.index(run.link))
        return tuple(blocks), tuple(link_of)
