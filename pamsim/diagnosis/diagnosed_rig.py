"""A rig beside its recordings, as a diagnosis asks for it: residuals, signals, a menu."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.trial_prediction import CHANNELS, Prediction, TrialPredictor, check_channels
from pamsim.comparison.trial_residuals import Values
from pamsim.core.errors import InputError, ParameterError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.experiment_menu import MENU
from pamsim.diagnosis.method.next_experiment import Signals
from pamsim.engine.batch import simulate_batch
from pamsim.engine.preflight import check_timestep
from pamsim.engine.rig import Rig
from pamsim.inference.residual_block import Blocks
from pamsim.recordings.recording import Outcome, Recording
from pamsim.recordings.sensors import distorted

_COARSE = 2
"""Fine steps in a coarse one: the MAS-20 arm's signals then move by a sixteenth of the sensors'
noise, and by a hundredth or two once corrected. Twice as many would leave no room for the stiff
bristles of friction that sticks: their step would be too long."""

_SETTLE = 4
"""Coarse steps in one of those in which rigs come to rest."""

_SENSOR = "sensor."

_KEPT = 32
"""Predictions of the fitted trials that are kept: where a fit ends is asked for once more with the
held-out trials, and the next fit often begins there."""


class DiagnosedRig:
    """Simulates what a diagnosis compares.

    Args:
        rig: without effects.
        data: recordings of it.
        held_out: names of the trials that are kept for judging.
        channels: kinds of channel to compare.
        threads: simulations at a time; None for one per processor.
        simulated: called as each simulation ends.

    Raises:
        InputError: for an unknown channel, or a trial that does not fit the rig.
    """

    def __init__(
        self,
        rig: Rig,
        data: CalibrationData,
        held_out: Sequence[str],
        *,
        channels: Sequence[str] = CHANNELS,
        threads: int | None = None,
        simulated: Callable[[], None] | None = None,
    ) -> None:
        self.rollouts = 0
        self._simulated = simulated
        self._rig = rig
        self._held_out = frozenset(held_out)
        self._fitted = frozenset(t.name for t in data.trials) - self._held_out
        self._threads = threads
        self._predictor = TrialPredictor(
            rig, data, channels=check_channels(channels), threads=threads, simulated=self._counted
        )
        rates = [e.sample_rate for e in self._predictor.experiments]
        self._coarse = _coarse_step(rig, rates)
        self._coarse_runs, self._settle = False, _SETTLE
        self._kept: OrderedDict[tuple[object, ...], Prediction] = OrderedDict()
        self._predictor.linearise_starts(rig, timestep=self._coarse)

    def residuals(
        self, sets: Sequence[Values], *, held_out: bool, fine: bool
    ) -> list[Blocks | None]:
        """See `pamsim.comparison.trial_residuals.SimulateValues`."""
        while True:
            step = None if fine else self._coarse
            predictions = self._predictions(
                sets, step, 1 if fine else self._settle, held_out=held_out
            )
            if step is None or self._coarse_runs:
                break
            self._coarse_runs = any(prediction is not None for prediction in predictions)
            if self._coarse_runs:
                break
            # Too coarse for this rig: its first simulation broke down.
            half = 0.5 * step
            if half < 1.5 * self._rig.model.opt.timestep:
                self._coarse, self._settle = None, 1
            else:
                self._coarse = half
            self._predictor.linearise_starts(self._rig, timestep=self._coarse)
        return [None if p is None else self._predictor.blocks(p) for p in predictions]

    def _predictions(
        self, sets: Sequence[Values], step: float | None, settle_steps: int, *, held_out: bool
    ) -> list[Prediction | None]:
        """Predictions of the fitted trials or of all; what is kept is not simulated again."""
        rigs = self._rigs(sets, step)
        keys = [(step, settle_steps, tuple(sorted(values.items()))) for values in sets]
        kept = [self._kept.get(key) for key in keys]

        def simulated(again: bool, left_out: frozenset[str]) -> list[Prediction | None]:
            wanted = [
                rig if (one is not None) == again else None
                for rig, one in zip(rigs, kept, strict=True)
            ]
            return self._predictor.predictions(
                wanted, left_out=left_out, timestep=step, settle_steps=settle_steps
            )

        new = simulated(False, frozenset() if held_out else self._held_out)
        rest = simulated(True, self._fitted) if held_out else kept
        found: list[Prediction | None] = []
        for key, fitted, own, other in zip(keys, kept, new, rest, strict=True):
            one = own
            if fitted is not None and other is not None:
                one = replace(fitted, trials={**fitted.trials, **other.trials})
            found.append(one)
            if one is not None:
                self._keep(key, one)
        return found

    def _keep(self, key: tuple[object, ...], one: Prediction) -> None:
        trials = {name: found for name, found in one.trials.items() if name in self._fitted}
        self._kept[key] = replace(one, trials=trials)
        self._kept.move_to_end(key)
        if len(self._kept) > _KEPT:
            self._kept.popitem(last=False)

    def signals(self, values: Values) -> Mapping[str, Mapping[str, FloatArray]]:
        """Simulated signals of every trial at its own times, trial -> channel -> (n,) [SI]."""
        (prediction,) = self._predictor.predictions(self._rigs([values], None))
        return {} if prediction is None else prediction.trials

    def menu(self, sets: Sequence[Values]) -> list[Signals | None]:
        """See `pamsim.diagnosis.method.next_experiment.SimulateMenu`."""
        rigs = self._rigs(sets, self._coarse)
        muscles = len(self._rig.muscles)
        loads = self._rig.takes_load
        menu = {n: p.experiment(muscles=muscles) for n, p in MENU.items() if loads or not p.load}
        jobs = [(r, experiment) for r in rigs if r is not None for experiment in menu.values()]
        done = simulate_batch(
            jobs,
            timestep=self._coarse,
            threads=self._threads,
            simulated=self._counted,
            above_supply=True,
        )
        runs = iter(done)
        return [
            None if rig is None else _signals(rig, {name: next(runs) for name in menu})
            for rig in rigs
        ]

    def _counted(self) -> None:
        self.rollouts += 1
        if self._simulated is not None:
            self._simulated()

    def _rigs(self, sets: Sequence[Values], step: float | None) -> list[Rig | None]:
        """The rig with values; those that differ in their sensors alone share a model."""
        plain: dict[tuple[tuple[str, float], ...], Rig | None] = {}
        rigs: list[Rig | None] = []
        for values in sets:
            sensor = {n: v for n, v in values.items() if n.startswith(_SENSOR)}
            rest = {n: v for n, v in values.items() if n not in sensor}
            key = tuple(sorted(rest.items()))
            if key not in plain:
                plain[key] = self._possible(rest, step)
            rig = plain[key]
            try:
                rigs.append(None if rig is None else rig.with_parameters(sensor))
            except ParameterError:  # an open end of a range
                rigs.append(None)
        return rigs

    def _possible(self, values: Values, step: float | None) -> Rig | None:
        """The rig with values; None where they are out of range or too quick for the time step."""
        try:
            rig = self._rig.with_parameters(values)
            _check(rig, step)
        except (InputError, ParameterError):
            return None
        return rig


def _check(rig: Rig, step: float | None) -> None:
    # Without load, where friction stops the arm soonest.
    check_timestep(rig.model_for(timestep=step), rig.muscles)


def _coarse_step(rig: Rig, rates: Sequence[float]) -> float | None:
    """Coarse time step [s]; None where the rig or a sampling rate needs the rig's own."""
    step = _COARSE * float(rig.model.opt.timestep)
    ratios = [1.0 / (rate * step) for rate in rates]
    if any(abs(r - round(r)) > 1e-6 * r or round(r) < 1 for r in ratios):
        return None
    try:
        _check(rig, step)
    except InputError:
        return None
    return step


def _signals(rig: Rig, runs: Mapping[str, Recording]) -> Signals | None:
    if any(run.outcome is not Outcome.COMPLETED for run in runs.values()):
        return None
    signals: dict[str, dict[str, FloatArray]] = {}
    for name, run in runs.items():
        seen = run if rig.sensor is None else distorted(run, rig.sensor)
        signals[name] = seen.signals()
    return signals
