"""A rig simulated link by link with many parameter sets, beside trials that repeat each other.

With the rig as it is, every trial is simulated with its own measured inputs, in fine time steps.
With other parameters the repeats of an input are simulated once, with the mean of their inputs and
in coarse steps; the difference between the two at the rig as it is is added to all of them. So
noise that a trial's inputs bring along counts as noise of its residual, and costs one simulation.

A parameter may have a value of its own in each link (`in_link`), as nuisance parameters have: what
is wrong in one link is then not made up for in another.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.experiments import grid_rate
from pamsim.comparison.link_inputs import link_inputs
from pamsim.comparison.link_noise import OutputNoise, link_noise
from pamsim.comparison.link_simulation import (
    LinkExperiment,
    Signals,
    creeps,
    forces_read,
    link_experiment,
    link_residuals,
    link_signals,
    moment_arms,
    torques_beyond,
)
from pamsim.comparison.links import VALVES, Link, LinkRun, Runs, joined_runs
from pamsim.comparison.repeats import Repeats
from pamsim.comparison.way_to_rest import ways_to_rest
from pamsim.core.errors import InputError, ParameterError
from pamsim.core.units import FloatArray
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import Rig
from pamsim.inference.blocks import Block
from pamsim.recordings.trial import Trial

Values = Mapping[str, float]
"""Name of a rig parameter, alone or `in_link`, to its value [SI]; others are the rig's own."""

_IN = " in "

_OF_VALVES = frozenset({"valve", "chamber"})
_OF_FORCE_ALONE = frozenset({"creep", "friction", "joint", "body"})
"""Groups of parameters without influence on pressures along an imposed motion. Those of the active
force have: the volume is its derivative by the pressure (virtual work). So has the stiffness of the
passive one, on which the length of a slack muscle depends."""

COARSE, MIDDLE = 10, 2
"""Fine time steps in one of a search, and of what is judged. Signals of the MAS-20 arm come late by
half a step or so: what an effect changes is wrong by 2 to 10 % in the first, 1 % or less in the
second. So a fit that has ended goes on with the second's residual there. A rig or a sampling rate
that needs shorter steps gets them, as the bristles of sticking friction."""

_STEPS = (COARSE, 5, MIDDLE, 1)
_SETTLE, _SETTLED = 4, 20  # time steps in one in which rigs come to rest at most; fine ones


def in_link(name: str, link: Link) -> str:
    """Name of a parameter's value in one link alone."""
    return f"{name}{_IN}{link.name}"


def plain(name: str) -> str:
    """Name of the rig's parameter, without the link."""
    return name.partition(_IN)[0]


@dataclass(frozen=True, eq=False)
class _Job:
    """One run to be simulated: number of the parameter set, of the run, its rig and time steps."""

    number: int
    run: int
    rig: Rig
    steps: int


class ChainSimulator:
    """Residuals of all links as one vector, simulated minus measured.

    Args:
        rig: as it is.
        groups: repeats, with channels as the rig names them.
        divided: into which links.
        threads: simulations at a time; None for one per processor.
        simulated: called as each simulation ends.

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
        simulated: Callable[[], None] | None = None,
    ) -> None:
        self.rig, self.repeats = rig, tuple(groups)
        trials = [trial for group in groups for trial in group.trials]
        self._threads, self._simulated = threads, simulated
        self._fine = float(rig.model.opt.timestep)
        exact = {
            (link, block.trial, block.channel): block.residual
            for link, blocks in link_residuals(
                rig, trials, divided=divided, threads=threads, simulated=simulated
            ).items()
            for block in blocks
        }
        if not exact:
            raise InputError("no link can be compared: nothing is measured that drives nothing")
        self.links = tuple(dict.fromkeys(link for link, _, _ in exact))
        means = [group.mean() for group in groups]
        self._runs: list[tuple[Repeats, Trial, LinkRun]] = [
            (group, mean, run)
            for group, mean in zip(groups, means, strict=True)
            for run in divided(rig, mean)
            if all((run.link, t.name, c) in exact for t in group.trials for c in run.outputs)
        ]
        self._inputs = {mean.name: link_inputs(rig, mean) for mean in means}
        begun = {m.name: m for _, m, run in self._runs if run.pressures and run.moved}
        self._ways = ways_to_rest(rig, self._inputs, list(begun.values()), threads, simulated)
        self._pulled = any(run.pulled for _, _, run in self._runs)
        self._pulls: dict[str, tuple[FloatArray, FloatArray]] = {}  # forces and arms of each mean
        self._driven: dict[tuple[object, ...], LinkExperiment] = {}  # of each run, with the inputs
        self._possible = self._possible_steps()
        self.noise = link_noise(
            rig, trials, exact, divided=divided, threads=threads, simulated=simulated
        )
        self.blocks, self.link_of = self._blocks(self.noise)
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
            own, _, where = name.partition(_IN)
            group = ParameterName.parse(own).group
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
        rigs = [self._rigs(v, own) for v, own in zip(sets, links, strict=True)]
        jobs = [
            _Job(number, run, rig, self._longest(run, limit, steps))
            for number, (own, wanted) in enumerate(zip(rigs, links, strict=True))
            if own is not None
            for run, (rig, limit) in self._wanted(own, wanted, only)
        ]
        signals = self._simulate([j for j in jobs if not self._run(j).pulled], {})
        torques = {
            (j.number, self._runs[j.run][1].name): self._torques(j, seen)
            for j, seen in signals.items()
            if self._pulled and self._run(j).gives_forces and seen is not None
        }
        signals |= self._simulate([j for j in jobs if self._run(j).pulled], torques)
        found = [None if own is None else others.copy() for own in rigs]
        for job, seen in signals.items():
            if seen is None:
                found[job.number] = None
        for job, seen in signals.items():
            residual = found[job.number]
            if residual is None or seen is None or self._run(job).link not in links[job.number]:
                continue
            group, mean, run = self._runs[job.run]
            less: FloatArray | float = 0.0
            if run.pulled in run.moved:
                less = torques[job.number, mean.name][run.pulled]
            for trial in group.trials:
                for channel in run.outputs:
                    rows = self._rows[job.run, trial.name, channel]
                    residual[rows] = (
                        seen[channel] - less - trial.measured[channel]
                    ) + self._correction(job.steps)[rows]
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

    def _run(self, job: _Job) -> LinkRun:
        return self._runs[job.run][2]

    def _longest(self, run: int, limit: int, most: int) -> int:
        """Fine time steps in one: the most that a run and its rig allow."""
        return next(n for n in _STEPS if n <= min(limit, most) and n in self._possible[run])

    def _rigs(self, values: Values, links: Collection[Link]) -> dict[Link, tuple[Rig, int]] | None:
        """The rig with values in each link, and its most fine time steps in one.

        None where a value is out of range, or too quick for any time step.
        """
        needed = self.links if self._pulled else links
        common = {name: value for name, value in values.items() if _IN not in name}
        made: dict[tuple[tuple[str, float], ...], tuple[Rig, int]] = {}
        found: dict[Link, tuple[Rig, int]] = {}
        for link in needed:
            end = f"{_IN}{link.name}"
            own = {plain(n): v for n, v in values.items() if n.endswith(end)}
            key = tuple(sorted((common | own).items()))
            if key not in made:
                try:
                    rig = self.rig.with_parameters(common | own)
                except (InputError, ParameterError):
                    return None
                limit = self._limit(rig)
                if limit is None:
                    return None
                made[key] = rig, limit
            found[link] = made[key]
        return found

    def _wanted(
        self,
        rigs: Mapping[Link, tuple[Rig, int]],
        links: Collection[Link],
        only: Collection[str] | None,
    ) -> Iterator[tuple[int, tuple[Rig, int]]]:
        """Runs that are simulated, each with its rig; joints that are pulled need the forces."""
        pulled = any(run.pulled and run.link in links for _, _, run in self._runs)
        for number, (group, _, run) in enumerate(self._runs):
            needed = run.link in links or (pulled and run.gives_forces)
            if needed and (only is None or group.name in only):
                yield number, rigs[run.link]

    def _simulate(
        self, jobs: Sequence[_Job], torques: Mapping[tuple[int, str], Mapping[str, FloatArray]]
    ) -> dict[_Job, Signals | None]:
        found: dict[_Job, Signals | None] = dict.fromkeys(jobs)
        known = [
            j
            for j in jobs
            if not self._run(j).pulled or (j.number, self._runs[j.run][1].name) in torques
        ]
        for steps in dict.fromkeys(job.steps for job in known):
            own = [job for job in known if job.steps == steps]
            signals = link_signals(
                [(job.rig, self._experiment(job, torques)) for job in own],
                timestep=steps * self._fine,
                settle_steps=1 if steps == 1 else min(_SETTLE, _SETTLED // steps),
                threads=self._threads,
                simulated=self._simulated,
            )
            found.update(zip(own, signals, strict=True))
        return found

    def _experiment(
        self, job: _Job, torques: Mapping[tuple[int, str], Mapping[str, FloatArray]]
    ) -> LinkExperiment:
        _, mean, run = self._runs[job.run]
        leads = run.pressures and bool(run.moved) and not creeps(job.rig)
        sensor, stops = job.rig.sensor, job.rig.model.jnt_range
        key = job.run, leads, sensor, stops.tobytes()
        known = self._driven.get(key)
        if known is None or run.pulled:
            known = link_experiment(
                job.rig,
                mean,
                run,
                self._inputs[mean.name],
                way=self._ways.get(mean.name) if leads else None,
                torque=torques[job.number, mean.name][run.pulled] if run.pulled else None,
            )
        if not run.pulled and sensor == self.rig.sensor:
            self._driven[key] = known
        return known

    def _torques(self, job: _Job, signals: Signals) -> dict[str, FloatArray]:
        mean = self._runs[job.run][1]
        if mean.name not in self._pulls:
            arms = moment_arms(self.rig, self._inputs[mean.name])
            self._pulls[mean.name] = forces_read(self.rig, mean), arms
        return torques_beyond(job.rig, mean, *self._pulls[mean.name], signals)

    def _possible_steps(self) -> list[tuple[int, ...]]:
        """Fine time steps in one that the sampling of each run allows."""
        found: list[tuple[int, ...]] = []
        for number, (_, mean, run) in enumerate(self._runs):
            rate = grid_rate(mean.time)
            if not run.pulled:
                rate = self._experiment(_Job(0, number, self.rig, 1), {}).experiment.sample_rate
            periods = [1.0 / (rate * steps * self._fine) for steps in _STEPS]
            whole = [abs(n - round(n)) <= 1e-6 * n and round(n) >= 1 for n in periods]
            found.append(tuple(n for n, good in zip(_STEPS, whole, strict=True) if good or n == 1))
        return found

    def _limit(self, rig: Rig) -> int | None:
        """Most fine time steps in one that a rig allows; None if it allows none."""
        for steps in _STEPS:
            try:
                check_timestep(rig.model_for(timestep=steps * self._fine), rig.limits)
            except InputError:
                continue
            return steps
        return None

    def _blocks(
        self, noise: Mapping[tuple[Link, str], OutputNoise]
    ) -> tuple[tuple[Block, ...], tuple[int, ...]]:
        blocks: list[Block] = []
        link_of: list[int] = []
        self._rows: dict[tuple[int, str, str], slice] = {}
        end = 0
        for number, (group, _, run) in enumerate(self._runs):
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
                            noise=noise[run.link, channel].noise,
                            source=trial.name,
                        )
                    )
                    link_of.append(self.links.index(run.link))
        return tuple(blocks), tuple(link_of)
