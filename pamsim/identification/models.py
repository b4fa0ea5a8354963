"""The models that ``pamsim identify`` fits side by side."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from pamsim.core.errors import InputError, nearest
from pamsim.core.progress import Progress
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.discrete_fit import fit_arx_records, fit_oe
from pamsim.linear.identified_model import FitStatus, IdentifiedModel
from pamsim.linear.residual_independence import Independence, residual_independence
from pamsim.linear.signal_record import SignalRecord

Fitter = Callable[[], IdentifiedModel]

DEAD_TIMES = ("auto", "none", "free")
POLES = ("auto", "real", "any")
_CLOSE = 2.0  # ratio of two time constants that merge
_BESIDE_ARX = ((1, 1, 1), (2, 2, 1))
_BESIDE_OE = ((1, 1, 1), (2, 2, 1))  # a sampled second order has two b


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Which models to fit.

    Attributes:
        order: of the continuous model; None for first and second.
        zeros: of that order.
        poles: ``real`` lags, ``any`` stable poles, or ``auto``: any beside real where two lags
            merge.
        dead_time: ``none``, ``free``, or ``auto`` for both.
        arx: (na, nb, nk); None for two small ones.
        oe: (nb, nf, nk); None for two small ones.
        start: of every trial: at ``rest``, or in a ``free`` state that is fitted.
    """

    order: int | None = None
    zeros: int = 0
    poles: str = "auto"
    dead_time: str = "auto"
    arx: tuple[int, int, int] | None = None
    oe: tuple[int, int, int] | None = None
    start: str = "rest"

    def __post_init__(self) -> None:
        """Check the words.

        Raises:
            InputError: for an unknown word, or zeros without an order.
        """
        for option, word, known in (
            ("--dead-time", self.dead_time, DEAD_TIMES),
            ("--poles", self.poles, POLES),
            ("--start", self.start, ("rest", "free")),
        ):
            if word not in known:
                raise InputError(f"{option} {word!r} is not known; {nearest(word, known)}")
        if self.zeros and self.order is None:
            raise InputError("--zeros needs --order: zeros of which model?")


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One fitted model.

    Attributes:
        name: such as ``second_order_dead_time``.
        fit: the numbers.
        independence: whether past inputs explain anything of its residuals; None if that could
            not be tested.
    """

    name: str
    fit: IdentifiedModel
    independence: Independence | None


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """All models of one choice.

    Attributes:
        candidates: in the order they were fitted: continuous, ARX, OE.
        skipped: name -> why it could not be fitted.
    """

    candidates: tuple[Candidate, ...]
    skipped: Mapping[str, str] = field(default_factory=dict)


def fit_models(
    records: Sequence[SignalRecord],
    held_out: Sequence[SignalRecord],
    choice: Choice,
    progress: Progress | None = None,
) -> Fitted:
    """IdentifiedModel every model of a choice.

    Args:
        records: to fit.
        held_out: to simulate only.
        choice: which models.
        progress: told ``(done, total, what)``.

    Raises:
        InputError: what the first continuous model refuses, if none can be fitted.
    """
    found: list[Candidate] = []
    skipped: dict[str, str] = {}
    refusals: list[InputError] = []

    def attempt(name: str, fit_it: Fitter) -> IdentifiedModel | None:
        if progress is not None:
            done = len(found) + len(skipped)
            progress(done, max(total, done + 1), name)
        try:
            fit = fit_it()
        except InputError as error:
            refusals.append(error)
            skipped[name] = str(error)
            return None
        found.append(Candidate(name=name, fit=fit, independence=_independence(fit, records)))
        return fit

    def continuous(order: int, delay: bool, real: bool) -> IdentifiedModel | None:
        return attempt(
            _name(order, choice.zeros, delay, real),
            lambda: fit_continuous(
                records,
                order=order,
                zeros=choice.zeros,
                dead_time=delay,
                real_lags=real,
                start=choice.start,
                held_out=held_out,
            ),
        )

    arx = _BESIDE_ARX if choice.arx is None else (choice.arx,)
    oe = _BESIDE_OE if choice.oe is None else (choice.oe,)
    orders = (1, 2) if choice.order is None else (choice.order,)
    delays = {"auto": (False, True), "none": (False,), "free": (True,)}[choice.dead_time]
    jobs = [(order, delay) for order in orders for delay in delays]
    total = len(jobs) + len(arx) + len(oe)
    for order, delay in jobs:
        real = order == 1 or choice.poles != "any"
        fit = continuous(order, delay, real)
        if real and choice.poles == "auto" and _merged(fit):
            continuous(order, delay, False)
    if not found:
        raise refusals[0]
    for na, nb, nk in arx:
        fit = attempt(f"arx_{na}_{nb}_{nk}", _arx(records, na, nb, nk))
        # A single step may not tell one b from the next.
        if fit is None and choice.arx is None and nb > 1:
            attempt(f"arx_{na}_{nb - 1}_{nk}", _arx(records, na, nb - 1, nk))
    for nb, nf, nk in oe:
        attempt(f"oe_{nb}_{nf}_{nk}", functools.partial(fit_oe, records, nb=nb, nf=nf, nk=nk))
    return Fitted(candidates=tuple(found), skipped=skipped)


def _merged(fit: IdentifiedModel | None) -> bool:
    """Whether two lags that the data do not tell apart may be a pair that swings."""
    if fit is None or fit.status is not FitStatus.DEGENERATE:
        return False
    return any(b < _CLOSE * a for a, b in itertools.pairwise(fit.time_constants))


def _arx(records: Sequence[SignalRecord], na: int, nb: int, nk: int) -> Fitter:
    return functools.partial(fit_arx_records, records, na=na, nb=nb, nk=nk)


def _name(order: int, zeros: int, delay: bool, real: bool) -> str:
    name = {1: "first_order", 2: "second_order"}.get(order, f"order_{order}")
    name += f"_zeros_{zeros}" if zeros else ""
    name += "" if real else "_any_poles"
    return name + ("_dead_time" if delay else "")


def _independence(fit: IdentifiedModel, records: Sequence[SignalRecord]) -> Independence | None:
    try:
        return residual_independence(fit, records)
    except InputError:
        return None
