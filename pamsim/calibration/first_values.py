"""Values of a rig's parameters to begin a fit with, from a file that may be far off.

Each link is simulated alone, its measured inputs imposed, so that what is wrong in one does not
bend the fit of another. The order is a person's, from the joint back to the valves, which need the
volumes of the muscles: first the lengths at which muscles are mounted, which decide where the joint
rests; then how hard they pull and push back; then what brakes the motion; last how the air flows.
In the end all parameters are fitted to all links together.

Repeats are simulated once, with the mean of their inputs, and in coarse time steps: a calibration
of the whole chain follows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from pamsim.calibration.calibration_problem import possible
from pamsim.comparison.chain_runs import COARSE, ChainRuns, Outputs, Values
from pamsim.comparison.free_parameters import FreedParameter, rig_values
from pamsim.comparison.links import JOINT, MUSCLE, VALVES, Link, LinkRun, link_runs
from pamsim.comparison.repeats import repeats
from pamsim.core.units import FloatArray
from pamsim.engine.parameter_names import ParameterName
from pamsim.engine.rig import Rig
from pamsim.inference.fit_simulator import fit_simulator
from pamsim.inference.simulator_fit import Blocks, ResidualBlock
from pamsim.recordings.trial import Trial

_VALVES, _NATIVE = ("valve", "chamber"), "native"
_FIRST = (("mounting",), ("force", "passive", "braid"))
"""Groups of parameters that decide where a joint rests, in the order in which they join a fit."""


class _Stage(NamedTuple):
    """Parameters that are fitted together, and the links whose outputs they are fitted to."""

    freed: list[FreedParameter]
    links: list[Link]

    @property
    def text(self) -> str:
        where = "all links" if len(self.links) > 1 else self.links[0].name
        return f"{where}: {', '.join(one.name for one in self.freed)}"


def first_values(
    rig: Rig,
    trials: Sequence[Trial],
    freed: Sequence[FreedParameter],
    *,
    threads: int | None = None,
    simulated: Callable[[], None] | None = None,
    stage: Callable[[str], None] | None = None,
) -> tuple[FreedParameter, ...]:
    """The parameters freed, with starts at which a fit of the whole chain should begin.

    ``simulated`` is called as each simulation ends, ``stage`` before each fit with what it is
    about.

    Raises:
        InputError: for a trial that does not fit the rig, or rigs that break down in every run.
    """
    means = [group.mean() for group in repeats(trials)]
    runs = [(mean, run) for mean in means for run in link_runs(rig, mean)]
    chain = ChainRuns(rig, runs, threads=threads, simulated=simulated)
    now = {one.name: one for one in freed}
    for each in _stages(freed, runs):
        if stage is not None:
            stage(each.text)
        fit = fit_simulator(
            _residuals(chain, runs, each, list(now.values())),
            [now[one.name].free for one in each.freed],
            rough=True,
            central=False,
        )
        for one, value in zip(each.freed, fit.values.tolist(), strict=True):
            now[one.name] = replace(one, free=replace(one.free, start=value))
    return tuple(now.values())


def _stages(freed: Sequence[FreedParameter], runs: Sequence[tuple[Trial, LinkRun]]) -> list[_Stage]:
    links = sorted({run.link for _, run in runs}, key=lambda link: link.order, reverse=True)
    stages: list[_Stage] = []
    placed: list[FreedParameter] = []
    for link in links:
        own = [one for one in freed if _part(one) in link.parts and one not in placed]
        own.sort(key=_rank)
        placed += own
        stages += [
            _Stage([one for one in own if _rank(one) <= rank], [link])
            for rank in dict.fromkeys(map(_rank, own))
        ]
    if len(stages) > 1:
        stages.append(_Stage(list(freed), links))
    return stages


def _rank(one: FreedParameter) -> int:
    """Place of a parameter in the order of `_FIRST`; all others come last, together."""
    group = ParameterName.parse(one.name).group
    return next((i for i, groups in enumerate(_FIRST) if group in groups), len(_FIRST))


def _part(one: FreedParameter) -> str:
    if ParameterName.parse(one.name).owner == _NATIVE:
        return JOINT
    return VALVES if ParameterName.parse(one.name).group in _VALVES else MUSCLE


def _residuals(
    chain: ChainRuns,
    runs: Sequence[tuple[Trial, LinkRun]],
    stage: _Stage,
    begin: Sequence[FreedParameter],
) -> Callable[[FloatArray], list[Blocks | None]]:
    """Residuals of a stage's links; parameters that it does not fit keep their values."""
    names = [one.name for one in stage.freed]
    begun = False

    def together(sets: Sequence[Values]) -> list[dict[int, Outputs] | None]:
        return chain.simulate(sets, [stage.links] * len(sets), None, COARSE)

    def blocks(outputs: dict[int, Outputs]) -> Blocks:
        return [
            ResidualBlock(
                trial=f"{mean.name} {run.link.name}",
                protocol=mean.name,  # trials of one with other loads or inputs are no repeats
                channel=channel,
                residual=signals[channel] - mean.measured[channel],
                sample_interval=mean.sample_interval,
            )
            for (mean, run), (signals, _) in ((runs[k], o) for k, o in sorted(outputs.items()))
            for channel in run.outputs
        ]

    def simulate(vectors: FloatArray) -> list[Blocks | None]:
        nonlocal begun
        sets: list[dict[str, float]] = []
        for vector in vectors:
            own = dict(zip(names, vector.tolist(), strict=True))
            sets.append(rig_values(begin, [own.get(o.name, o.free.start) for o in begin]))
        found = possible(together, sets, begun=begun)
        begun = True
        return [None if outputs is None else blocks(outputs) for outputs in found]

    return simulate
