"""The models that ``identify`` fits side by side."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from pamsim.core.computation import Progress, Steps
from pamsim.core.errors import InputError, nearest
from pamsim.core.units import FloatArray
from pamsim.identification.choose import (
    Choice,
    by_free_run,
    by_likelihood,
    spanning_structures,
)
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.fit import fit as fit_model
from pamsim.identification.model import FitStatus, IdentifiedModel
from pamsim.identification.recommendation import Candidate, Recommendation, recommend
from pamsim.identification.records import SignalRecord
from pamsim.identification.residual_tests import (
    residual_independence,
    residual_nonlinearity,
)
from pamsim.identification.structure_scan import RoughFit, scan_structures

STARTS = ("rest", "free")
DEAD_TIMES = ("auto", "none", "free")
POLES = ("auto", "real", "any")
_CLOSE = 2.0  # ratio below which two time constants may be those of an oscillation
_DISCRETE = ((1, 1, 1), (2, 2, 1))  # one lag and two: a sampled second order has two b
_APART = 0.1  # of logarithms of time constants
_SCANNED = 60  # structures that a scan fits, about
_NOISE = 1e-3  # p-value below which the residuals of a model are more than noise
_TRIED = 10  # structures that are fitted in full until the data determine one


@dataclass(frozen=True, kw_only=True)
class ModelSet:
    """Which models to fit: attributes as the arguments of `identify`.

    An order of None chooses the structure by a scan and fits first and second order beside it.

    Raises:
        InputError: for an unknown word, discrete orders that are not three, or zeros or integrators
            without an order.
    """

    order: int | None = None
    zeros: int = 0
    poles: str = "auto"
    dead_time: str = "auto"
    arx: tuple[int, int, int] | None = None
    oe: tuple[int, int, int] | None = None
    start: str = "rest"
    integrators: int = 0

    def __post_init__(self) -> None:
        for argument, word, known in (
            ("dead_time", self.dead_time, DEAD_TIMES),
            ("poles", self.poles, POLES),
            ("start", self.start, STARTS),
        ):
            if word not in known:
                raise InputError(f"`{argument}` {word!r} is not known; {nearest(word, known)}")
        for argument, orders in (("arx", self.arx), ("oe", self.oe)):
            if orders is not None and len(orders) != 3:
                raise InputError(f"`{argument}` = {orders}: give three whole numbers, as (2, 2, 1)")
        for argument, count in (("zeros", self.zeros), ("integrators", self.integrators)):
            if count and self.order is None:
                raise InputError(f"`{argument}` needs `order`; give the order of the model")

    @property
    def delays(self) -> tuple[bool, ...]:
        """Whether models have a dead time: without, with, or both."""
        return {"auto": (False, True), "none": (False,), "free": (True,)}[self.dead_time]


@dataclass
class FittedModels:
    """All models of one identification: fits one after another and keeps what came of it."""

    asked: ModelSet  # which models to fit
    records: Sequence[SignalRecord]  # the trials they are fitted to
    held_out: Sequence[SignalRecord]  # trials that are simulated only
    steps: Steps  # of the progress
    # name -> model, in the order they were fitted: continuous, ARX, output error
    fitted: dict[str, Candidate] = field(default_factory=dict)
    # name -> why that model could not be fitted
    skipped: dict[str, str] = field(default_factory=dict)
    # of the scan over structures; None if the order was given
    choice: Choice[RoughFit] | None = None
    chosen: str = ""  # name of the candidate that the scan led to; empty without a scan
    why: str = ""  # the reason of that

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """All that could be fitted."""
        return tuple(self.fitted.values())

    def recommended(self) -> Recommendation:
        """The one to use."""
        return recommend(self.candidates, self.records, self.held_out, self.chosen, self.why)

    def attempt(
        self, name: str, fit_model: Callable[[], IdentifiedModel]
    ) -> IdentifiedModel | None:
        """Fit a model; None where that is refused."""
        self.steps.begin(name.replace("_", " "))
        try:
            fit = fit_model()
        except InputError as error:
            self.skipped[name] = str(error)
            return None
        independence = None
        with suppress(InputError):  # too few samples for the test
            independence = residual_independence(fit, self.records)
        self.fitted[name] = Candidate(name=name, fit=fit, independence=independence)
        return fit

    def continuous(
        self, structure: ContinuousStructure, starts: Sequence[FloatArray] = ()
    ) -> IdentifiedModel | None:
        """Fit a continuous model, unless it is there already."""
        name = _name(structure)
        if name in self.fitted:
            return self.fitted[name].fit
        return self.attempt(
            name, lambda: fit_model(self.records, structure, starts=starts, held_out=self.held_out)
        )

    def discrete(self, kind: str, na: int, nb: int, nk: int) -> IdentifiedModel | None:
        """Fit ARX or output error; None where the records do not determine it."""

        def found() -> IdentifiedModel:
            sample_time, start = self.records[0].sample_time, self.asked.start
            structure = DiscreteStructure(kind, na, nb, nk, sample_time, start)
            fit = fit_model(self.records, structure)
            if kind == "arx" and fit.covariance is None:
                raise InputError(fit.sentence)
            return fit

        orders = (na, nb, nk) if kind == "arx" else (nb, na, nk)
        return self.attempt("_".join(map(str, (kind, *orders))), found)

    def choose(self, fits: Sequence[RoughFit]) -> None:
        """Choose a structure of a scan; its intervals then span those that are not rejected.

        By likelihood, if that leads to a model whose residuals are noise; else, and where trials
        are held out to judge, by free runs.
        """
        trusted = False
        if not self.held_out:
            self._take(by_likelihood(fits, self.records))
            trusted = bool(self.chosen) and self._leaves_noise(self.fitted[self.chosen])
        if not trusted:
            self._take(by_free_run(fits, self.records, self.held_out))
        if self.chosen and self.choice is not None:
            candidate = self.fitted[self.chosen]
            wider = spanning_structures(candidate.fit, self.choice, self.records)
            self.fitted[self.chosen] = replace(candidate, fit=wider)

    def _take(self, choice: Choice[RoughFit]) -> None:
        self.choice = choice
        self.chosen, self.why = self._best_determined(choice)

    def _leaves_noise(self, candidate: Candidate) -> bool:
        """Whether the data determine a model, and neither input nor nonlinearity its residuals.

        The level is far below that of the tests that a recommendation has to pass: one right model
        in twenty fails these by chance, and is still the right one.
        """
        tested = candidate.independence
        if candidate.fit.status is not FitStatus.CONVERGED:
            return False
        if tested is not None and tested.p_value < _NOISE:
            return False
        try:
            return residual_nonlinearity(candidate.fit, self.records).p_value >= _NOISE
        except InputError:
            return True

    def _best_determined(self, choice: Choice[RoughFit]) -> tuple[str, str]:
        """The structure to use and the reason: what the data do not determine does not count.

        Unless all that they determine is materially worse: then the first choice remains, if it is
        not one whose poles or dead time imitate what the data do not show.
        """
        # What was not asked for, by dead time or complex poles.
        without = {
            i
            for i, fit in enumerate(choice.fits)
            if fit.structure.dead_time not in self.asked.delays
            or (self.asked.poles == "real" and np.iscomplexobj(fit.structure.constants(fit.x)))
        }
        refuted = set(without)
        first = "", ""
        for _ in range(_TRIED):
            if len(without) == len(choice.fits):
                break
            place, why = choice.pick(without)
            if first[0] and choice.materially_worse(place, refuted):
                break
            rough = choice.fits[place].structure
            names: list[str] = []
            for structure, start in _forms(choice.fits[place]):
                fit = self.continuous(structure, [start])
                names += [] if fit is None else [_name(structure)]
                if fit is not None and fit.status is FitStatus.CONVERGED:
                    return names[-1], why
            others = list(enumerate(fit.structure for fit in choice.fits))
            larger = {i for i, other in others if i == place or _larger(other, rough)}
            if rough.integrators:  # the data do not show them: what they gain is a drift's
                larger |= {i for i, other in others if other.integrators >= rough.integrators}
            if rough.integrators or any(self.fitted[name].fit.refuted for name in names):
                refuted |= larger
            elif names and not first[0]:
                first = names[0], why
            without |= larger
        return first


def fit_models(
    records: Sequence[SignalRecord],
    held_out: Sequence[SignalRecord],
    models: ModelSet,
    progress: Progress | None = None,
) -> FittedModels:
    """Fit every model of a set to the records; held-out ones are simulated only.

    Raises:
        InputError: that of the first continuous model, if none can be fitted.
    """
    arx_orders = _DISCRETE if models.arx is None else (models.arx,)
    oe_orders = _DISCRETE if models.oe is None else (models.oe,)
    inputs = len(records[0].units_input)
    if inputs > 1:
        if models.arx is not None or models.oe is not None:
            raise InputError("`arx` and `oe` are models of one input; omit them, or give one input")
        arx_orders = oe_orders = ()
    structures = [
        ContinuousStructure(
            order=order,
            zeros=models.zeros,
            dead_time=delay,
            real_lags=order < 2 or models.poles != "any",
            start=models.start,
            integrators=models.integrators,
            inputs=inputs,
        )
        for order in ((1, 2) if models.order is None else (models.order,))
        for delay in models.delays
    ]
    total = len(structures) + len(arx_orders) + len(oe_orders)
    total += _SCANNED if models.order is None else 0
    fitting = FittedModels(models, records, held_out, Steps(progress, total))
    fits: list[RoughFit] = []
    if models.order is None:
        fits = scan_structures(
            records, start=models.start, report=lambda each: fitting.steps.begin(each.sentence)
        )
    for structure in structures:
        fit = fitting.continuous(structure, _starts(structure, fits))
        if structure.real_lags and models.poles == "auto" and _merged(fit):
            pairs = replace(structure, real_lags=False)
            fitting.continuous(pairs, _starts(pairs, fits))
    if not fitting.fitted:
        raise InputError(next(iter(fitting.skipped.values())))
    if models.order is None:
        fitting.choose(fits)
    for na, nb, nk in arx_orders:
        # A single step may not separate one b from the next.
        for b in (nb,) if models.arx is not None else range(nb, 0, -1):
            if fitting.discrete("arx", na, b, nk) is not None:
                break
    for nb, nf, nk in oe_orders:
        fitting.discrete("oe", nf, nb, nk)
    return fitting


def _starts(structure: ContinuousStructure, fits: Sequence[RoughFit]) -> list[FloatArray]:
    """Where the scan found as many poles and zeros, and the dead time; none where it did not."""
    same = replace(structure, real_lags=False)
    found = [fit for fit in fits if replace(fit.structure, drift=False) == same]
    # Apart, since the cost has a saddle where time constants are equal.
    return [
        fit.x if structure.pairs or structure.order < 2 else _lags(fit, _APART) for fit in found
    ]


def _lags(rough: RoughFit, apart: float = 0.0) -> FloatArray:
    """Start of a search with real poles in the place of a rough fit's, moved apart."""
    order = rough.structure.order
    logs = np.log(np.sort(np.abs(rough.structure.constants(rough.x))))
    return np.append(logs + np.linspace(-apart, apart, order), rough.x[order:])


def _forms(rough: RoughFit) -> list[tuple[ContinuousStructure, FloatArray]]:
    """The structure with any poles and where its search begins; before it with real ones."""
    forms = [(rough.structure, rough.x)]
    if not np.iscomplexobj(rough.structure.constants(rough.x)):
        # Time constants read better than the frequency and damping of two lags.
        forms.insert(0, (replace(rough.structure, real_lags=True), _lags(rough)))
    return forms


def _larger(other: ContinuousStructure, than: ContinuousStructure) -> bool:
    """Whether a structure contains one whose numbers the data do not determine."""
    zeros = zip(other.numerator_zeros, than.numerator_zeros, strict=True)
    return (
        other.order >= than.order
        and all(more >= less for more, less in zeros)
        and other.integrators >= than.integrators
        and set(other.delayed) >= set(than.delayed)
    )


def _merged(fit: IdentifiedModel | None) -> bool:
    """Whether two lags that the data do not separate may be an oscillating pair."""
    if fit is None or fit.status is not FitStatus.DEGENERATE:
        return False
    return any(b < _CLOSE * a for a, b in itertools.pairwise(fit.time_constants))


def _name(structure: ContinuousStructure) -> str:
    poles = {0: "gain", 1: "first_order", 2: "second_order"}
    zeros = structure.zeros_each or (structure.zeros,)
    parts = {
        poles.get(structure.order, f"order_{structure.order}"): True,
        f"zeros_{'_'.join(map(str, zeros))}": structure.zeros > 0,
        "any_poles": structure.pairs > 0,
        "integrator": structure.integrators == 1,
        "two_integrators": structure.integrators == 2,
        "dead_time": structure.dead_time,
        f"of_{'_'.join(str(i + 1) for i in structure.delayed)}": bool(structure.undelayed),
        "drift": structure.drift,
    }
    return "_".join(part for part, has in parts.items() if has)
