"""Runs of a rig's links beside trials or the means of repeats, simulated with many parameter sets.

What depends on the measured signals alone is found once for all sets: smoothed inputs, the way to
rest, how each run is driven, the time steps that its sampling allows, moment arms of rigs whose
tendons run as the rig's as it is.

A parameter may have a value of its own in each link (`in_link`), as nuisance parameters have: what
is wrong in one link is then not made up for in another.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import mujoco
import numpy as np

from pamsim.comparison.experiments import grid_rate, sensed_runs, sensed_signals
from pamsim.comparison.link_inputs import inputs_of_runs
from pamsim.comparison.link_simulation import (
    Signals,
    arms_along,
    forces_read,
    link_experiment,
    torques_beyond,
    ways_to_rest,
    with_effort,
)
from pamsim.comparison.links import Link, LinkRun, Runs, link_runs
from pamsim.core.errors import InputError, ParameterError
from pamsim.core.units import FloatArray
from pamsim.engine.joint_stiffness import swing_periods
from pamsim.engine.parameters import each_muscle
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import Rig
from pamsim.engine.state import RestSteps
from pamsim.recordings.experiment import Experiment
from pamsim.recordings.trial import Trial

Values = Mapping[str, float]
"""Name of a rig parameter, alone or `in_link`, to its value [SI]; others are the rig's own."""

_IN = " in "

COARSE, OF_REPEATS, MIDDLE = 10, 5, 2
"""Fine time steps in one of a search, of what repeats differ by, and of what is judged. Signals of
the MAS-20 arm come late by half a step or so: what an effect changes is wrong by 2 to 10 % in the
first, 1 % or less in the last. So a fit that has ended goes on with the last one's residual there.
A rig or a sampling rate that needs shorter steps gets them, as the bristles of sticking friction.
"""

_STEPS = (COARSE, OF_REPEATS, MIDDLE, 1)
_SETTLE, _SETTLED = 4, 20  # time steps in one in which rigs come to rest at most; fine ones
_PER_SWING, _SWINGS = 40, 10
"""Time steps in which a joint swings once on its way to rest, and swings until it hardly moves. In
longer ones, which damp the swings, dry friction leaves it elsewhere: a rail with 12 N by 1 mm in
8 steps, in 50 by less than its sensor's noise. On the shipped arm, which is slow, they are about
as long as the steps once it hardly moves."""


def in_link(name: str, link: Link) -> str:
    """Name of a parameter's value in one link alone."""
    return f"{name}{_IN}{link.name}"


def plain(name: str) -> str:
    """Name of the rig's parameter, without the link."""
    return name.partition(_IN)[0]


def place(name: str) -> str:
    """Name of the link in which alone a parameter has a value; empty for all."""
    return name.partition(_IN)[2]


Outputs = tuple[Signals, int]
"""Channel -> (n,) at the times of the trial [SI], and the fine time steps in one of the run."""

Residuals = Mapping[tuple[Link, str, str], FloatArray]
"""Link, trial and channel to simulated minus measured, (n,) [SI]."""


@dataclass(frozen=True, eq=False)
class _Job:
    """One run to be simulated: number of the parameter set and of the run, how, rig and steps."""

    number: int
    run: int
    mean: Trial
    how: LinkRun
    rig: Rig
    steps: int = 1


_Torques = Mapping[_Job, FloatArray]
"""Run of a joint that is pulled to (n,) torque [N m] or force [N]."""


class ChainRuns:
    """Runs that are simulated with many parameter sets.

    Args:
        rig: as it is.
        runs: trial, or mean of repeats, and how a link is simulated beside it.
        threads: simulations at a time; None for one per processor.
        simulated: called as each simulation ends.
    """

    def __init__(
        self,
        rig: Rig,
        runs: Sequence[tuple[Trial, LinkRun]],
        *,
        threads: int | None,
        simulated: Callable[[], None] | None = None,
    ) -> None:
        self._rig, self._runs = rig, tuple(runs)
        self._options: dict[str, Any] = {"threads": threads, "simulated": simulated}
        self._links = tuple(dict.fromkeys(run.link for _, run in runs))
        self._fine = float(rig.model.opt.timestep)
        self._inputs = inputs_of_runs(rig, runs)
        begun = {mean.name: mean for mean, run in runs if run.pressures and run.moved}
        run_all = partial(sensed_runs, **self._options)
        self._ways = ways_to_rest(rig, self._inputs, list(begun.values()), run_all)
        pulled = {mean.name: mean for mean, run in runs if run.pulled}
        self._forces = {name: forces_read(rig, mean) for name, mean in pulled.items()}
        self._arms = {name: arms_along(rig, self._inputs[name]) for name in pulled}
        self._data = mujoco.MjData(rig.model)  # in which the constants of other rigs are found
        self._driven: dict[tuple[object, ...], tuple[Trial, Experiment]] = {}  # own sensors
        self._possible = [self._possible_steps(number) for number in range(len(runs))]

    def simulate(
        self,
        sets: Sequence[Values],
        links: Sequence[Collection[Link]],
        only: Collection[str] | None,
        steps: int,
    ) -> list[dict[int, Outputs] | None]:
        """Simulate parameter sets.

        Args:
            sets: values by name.
            links: of each set, those to simulate.
            only: names of the means to simulate; None for all.
            steps: fine time steps in one, at most: `COARSE`, `MIDDLE` or 1.

        Returns:
            Number of the run to what it gives, for each set; None where a value is out of range or
            a simulation breaks down. Of a joint that a machine moves, the output is what that
            takes, less the torque of what cells read beyond the muscles' simulated forces.
        """
        rigs = self._rigs(sets, links)
        jobs: list[_Job] = []
        for number, (own, wanted) in enumerate(zip(rigs, links, strict=True)):
            # Joints that are pulled need the forces.
            pulled = any(how.pulled and how.link in wanted for _, how in self._runs)
            for run, (mean, how) in enumerate(self._runs):
                needed = how.link in wanted or (pulled and how.gives_forces)
                if own is not None and needed and (only is None or mean.name in only):
                    rig, limit = own[how.link]
                    jobs.append(_Job(number, run, mean, how, rig, self._longest(run, limit, steps)))
        found: list[dict[int, Outputs] | None] = [None if own is None else {} for own in rigs]
        for job, seen in self._given(jobs).items():
            outputs = found[job.number]
            if seen is None:
                found[job.number] = None
            elif outputs is not None and job.how.link in links[job.number]:
                outputs[job.run] = seen, job.steps
        return found

    def as_it_is(self, steps: int = 1) -> Iterator[tuple[Trial, LinkRun, Signals]]:
        """What each run gives with the rig as it is; none that breaks down.

        Time steps are fine ones, or so many of them in one where a run allows it.
        """
        found = self._with({})
        limit = 1 if found is None else found[1]
        jobs = [
            _Job(0, run, *both, self._rig, self._longest(run, limit, steps))
            for run, both in enumerate(self._runs)
        ]
        for job, seen in self._given(jobs).items():
            if seen is not None:
                yield job.mean, job.how, seen

    def _given(self, jobs: Sequence[_Job]) -> dict[_Job, Signals | None]:
        """What runs give; those of joints that are pulled come after the forces that pull them."""
        signals = self._signals([job for job in jobs if not job.how.pulled], {})
        exerted = {
            (job.number, job.mean.name): seen
            for job, seen in signals.items()
            if job.how.gives_forces and seen is not None
        }
        pulled = [job for job in jobs if job.how.pulled]
        torques = {
            job: self._torque(job, exerted[job.number, job.mean.name])
            for job in pulled
            if (job.number, job.mean.name) in exerted
        }
        signals |= self._signals(pulled, torques)
        for job, seen in signals.items():
            # Where a machine moves the joint, the torque is taken off what the motion takes.
            if seen is not None and job.how.pulled in job.how.moved:
                less = torques[job]
                signals[job] = {channel: seen[channel] - less for channel in job.how.outputs}
        return signals

    def _torque(self, job: _Job, exerted: Signals) -> FloatArray:
        """What cells read beyond the forces that muscles exert in a simulation, at the joint."""
        name, model, own = job.mean.name, job.rig.model, self._rig.model
        # Where tendons run, of what a parameter may change.
        same = all(
            np.array_equal(getattr(model, of), getattr(own, of)) for of in ("wrap_prm", "body_quat")
        )
        arms = self._arms[name] if same else arms_along(job.rig, self._inputs[name])
        return torques_beyond(job.rig, self._forces[name], arms, exerted)[job.how.pulled]

    def _rigs(
        self, sets: Sequence[Values], links: Sequence[Collection[Link]]
    ) -> list[dict[Link, tuple[Rig, int]] | None]:
        """The rig with each set's values in each link, and its most fine time steps in one.

        None where a value is out of range, or too quick for any time step.
        """
        made: dict[tuple[tuple[str, float], ...], tuple[Rig, int] | None] = {}

        def rig(values: Values, link: Link) -> tuple[Rig, int] | None:
            inside = {n: v for n, v in values.items() if not place(n)}
            inside |= {plain(n): v for n, v in values.items() if place(n) == link.name}
            key = tuple(sorted(inside.items()))
            if key not in made:
                made[key] = self._with(inside)
            return made[key]

        found: list[dict[Link, tuple[Rig, int]] | None] = []
        for values, wanted in zip(sets, links, strict=True):
            rigs = {link: rig(values, link) for link in (self._links if self._forces else wanted)}
            own = {link: one for link, one in rigs.items() if one is not None}
            found.append(own if len(own) == len(rigs) else None)
        return found

    def _with(self, values: Values) -> tuple[Rig, int] | None:
        """A rig, and the most fine time steps in one that it allows."""
        try:
            rig = self._rig.with_parameters(each_muscle(self._rig, values), data=self._data)
        except (InputError, ParameterError):
            return None
        model = rig.model_for(data=self._data if rig.compiled is self._rig.compiled else None)
        for steps in _STEPS:
            model.opt.timestep = steps * self._fine
            try:
                check_timestep(model, rig.limits)
            except InputError:
                continue
            return rig, steps
        return None

    def _longest(self, run: int, limit: int, most: int) -> int:
        """Fine time steps in one: the most that a run and its rig allow."""
        return next(n for n in _STEPS if n <= min(limit, most) and n in self._possible[run])

    @cached_property
    def _periods(self) -> FloatArray:
        """Periods in which the rig as it is swings before its trials [s]; none that is not held."""
        starts = {tuple(self._inputs[mean.name].start(mean).tolist()) for mean, _ in self._runs}
        return np.concatenate([swing_periods(self._rig, np.array(start)) for start in starts])

    def _rest_steps(self, steps: int) -> RestSteps | None:
        """Time steps to rest before runs in steps of so many fine ones; None for the runs' own."""
        if steps == 1:
            return None
        later = min(_SETTLE * steps, _SETTLED) * self._fine
        if not self._periods.size:
            return RestSteps(later=later)
        most = max(int(float(self._periods.min()) / _PER_SWING / self._fine), 1)
        swings = _SWINGS * float(self._periods.max())
        return RestSteps(later=later, swinging=most * self._fine, swings=swings)

    def _possible_steps(self, run: int) -> tuple[int, ...]:
        """Fine time steps in one that the sampling of a run allows."""
        mean, how = self._runs[run]
        rate = grid_rate(mean.time)
        if not how.pulled:
            job = _Job(0, run, mean, how, self._rig)
            rate = self._experiment(job, {})[1].sample_rate
        periods = [1.0 / (rate * steps * self._fine) for steps in _STEPS]
        whole = [abs(n - round(n)) <= 1e-6 * n and round(n) >= 1 for n in periods]
        return tuple(n for n, good in zip(_STEPS, whole, strict=True) if good or n == 1)

    def _signals(self, jobs: Sequence[_Job], torques: _Torques) -> dict[_Job, Signals | None]:
        # Rest is shared by what is simulated together, and is another with other drives.
        together: dict[tuple[int, object], dict[_Job, tuple[Rig, Trial, Experiment]]] = {}
        for job in jobs:
            if not job.how.pulled or job in torques:
                trial, experiment = self._experiment(job, torques)
                own = together.setdefault((job.steps, experiment.drives.muscles), {})
                own[job] = job.rig, trial, experiment
        found: dict[_Job, Signals | None] = dict.fromkeys(jobs)
        for (steps, _), own in together.items():
            signals = sensed_signals(
                list(own.values()),
                timestep=steps * self._fine,
                rest_steps=self._rest_steps(steps),
                **self._options,
            )
            found.update(zip(own, signals, strict=True))
        return found

    def _experiment(self, job: _Job, torques: _Torques) -> tuple[Trial, Experiment]:
        mean, run = job.mean, job.how
        leads = run.pressures and bool(run.moved)
        torque = torques[job] if run.pulled and run.pulled not in run.moved else None
        # What leads to a trial follows the torque that it begins with.
        added = None if leads else torque
        sensor, stops = job.rig.sensor, job.rig.model.jnt_range
        key = job.run, sensor, stops.tobytes()
        known = self._driven.get(key)
        if known is None:
            known = link_experiment(
                job.rig,
                mean,
                run,
                self._inputs[mean.name],
                way=self._ways.get(mean.name) if leads else None,
                torque=torque if added is None else np.zeros(mean.time.size),
            )
            if sensor == self._rig.sensor and (torque is None or added is not None):
                self._driven[key] = known
        if added is None:
            return known
        driven, experiment = known
        return driven, with_effort(experiment, run.pulled, added)


def link_residuals(
    rig: Rig,
    trials: Sequence[Trial],
    *,
    divided: Runs = link_runs,
    threads: int | None = None,
    simulated: Callable[[], None] | None = None,
    steps: int = 1,
) -> Residuals:
    """Residual of every output of every link that the trials separate, from the command on.

    Trials have channels as the rig names them. There are ``steps`` fine time steps in one, at most;
    other arguments are those of `ChainRuns`. Runs that break down are left out.

    Raises:
        InputError: for a trial that does not fit the rig, or does not give its start pressures.
    """
    runs = [(trial, run) for trial in trials for run in divided(rig, trial)]
    chain = ChainRuns(rig, runs, threads=threads, simulated=simulated)
    found = {
        (run.link, trial.name, channel): signals[channel] - trial.measured[channel]
        for trial, run, signals in chain.as_it_is(steps)
        for channel in run.outputs
    }
    return {key: found[key] for key in sorted(found, key=lambda key: key[0].order)}


def most_runs(rig: Rig, trials: Sequence[Trial]) -> int:
    """Simulations that `link_residuals` runs at most: the links, and one more for rest."""
    return sum(len(link_runs(rig, trial)) + 1 for trial in trials)
