"""The models that ``identify`` fits side by side."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pamsim.core.errors import InputError, nearest
from pamsim.core.progress import Progress
from pamsim.linear.continuous_fit import fit_continuous
from pamsim.linear.continuous_structure import STARTS
from pamsim.linear.discrete_fit import fit_arx_records, fit_oe
from pamsim.linear.identified_model import FitStatus, IdentifiedModel
from pamsim.linear.residual_independence import Independence, residual_independence
from pamsim.linear.signal_record import SignalRecord

DEAD_TIMES = ("auto", "none", "free")
POLES = ("auto", "real", "any")
_CLOSE = 2.0  # ratio below which two time constants may be those of an oscillation
_ARX = ((1, 1, 1), (2, 2, 1))
_OE = ((1, 1, 1), (2, 2, 1))  # a sampled second order has two b


@dataclass(frozen=True, kw_only=True)
class ModelSet:
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

    Raises:
        InputError: for an unknown word, or zeros without an order.
    """

    order: int | None = None
    zeros: int = 0
    poles: str = "auto"
    dead_time: str = "auto"
    arx: tuple[int, int, int] | None = None
    oe: tuple[int, int, int] | None = None
    start: str = "rest"

    def __post_init__(self) -> None:
        for argument, word, known in (
            ("dead_time", self.dead_time, DEAD_TIMES),
            ("poles", self.poles, POLES),
            ("start", self.start, STARTS),
        ):
            if word not in known:
                raise InputError(f"`{argument}` {word!r} is not known; {nearest(word, known)}")
        if self.zeros and self.order is None:
            raise InputError("`zeros` needs `order`: the order of the model that has them")


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One fitted model.

    Attributes:
        name: such as ``second_order_dead_time``.
        fit: the numbers.
        independence: whether past inputs explain part of its residuals; None if that could not be
            tested.
    """

    name: str
    fit: IdentifiedModel
    independence: Independence | None

    @property
    def continuous(self) -> bool:
        """Whether the model is a continuous one."""
        return self.fit.structure.kind == "continuous"


def fit_models(
    records: Sequence[SignalRecord],
    held_out: Sequence[SignalRecord],
    models: ModelSet,
    progress: Progress | None = None,
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """Fit every model of a set.

    Args:
        records: to fit.
        held_out: to simulate only.
        models: which models.
        progress: called before each fit.

    Returns:
        The models in the order they were fitted, continuous, ARX, output error; and for each that
        could not be fitted, why.

    Raises:
        InputError: that of the first continuous model, if none can be fitted.
    """
    fitted: list[Candidate] = []
    skipped: dict[str, str] = {}
    refusals: list[InputError] = []

    def attempt(name: str, fit_model: Callable[[], IdentifiedModel]) -> IdentifiedModel | None:
        if progress is not None:
            done = len(fitted) + len(skipped)
            progress(done, max(total, done + 1), name)
        try:
            fit = fit_model()
        except InputError as error:
            refusals.append(error)
            skipped[name] = str(error)
            return None
        fitted.append(Candidate(name=name, fit=fit, independence=_independence(fit, records)))
        return fit

    def continuous(order: int, delay: bool, real: bool) -> IdentifiedModel | None:
        return attempt(
            _name(order, models.zeros, delay, real),
            lambda: fit_continuous(
                records,
                order=order,
                zeros=models.zeros,
                dead_time=delay,
                real_lags=real,
                start=models.start,
                held_out=held_out,
            ),
        )

    def arx(na: int, nb: int, nk: int) -> IdentifiedModel | None:
        fit_model = functools.partial(fit_arx_records, records, na=na, nb=nb, nk=nk)
        return attempt(f"arx_{na}_{nb}_{nk}", fit_model)

    arx_orders = _ARX if models.arx is None else (models.arx,)
    oe_orders = _OE if models.oe is None else (models.oe,)
    orders = (1, 2) if models.order is None else (models.order,)
    delays = {"auto": (False, True), "none": (False,), "free": (True,)}[models.dead_time]
    structures = [(order, delay) for order in orders for delay in delays]
    total = len(structures) + len(arx_orders) + len(oe_orders)
    for order, delay in structures:
        real = order == 1 or models.poles != "any"
        fit = continuous(order, delay, real)
        if real and models.poles == "auto" and _merged(fit):
            continuous(order, delay, False)
    if not fitted:
        raise refusals[0]
    for na, nb, nk in arx_orders:
        # A single step may not separate one b from the next.
        if arx(na, nb, nk) is None and models.arx is None and nb > 1:
            arx(na, nb - 1, nk)
    for nb, nf, nk in oe_orders:
        attempt(f"oe_{nb}_{nf}_{nk}", functools.partial(fit_oe, records, nb=nb, nf=nf, nk=nk))
    return tuple(fitted), skipped


def _merged(fit: IdentifiedModel | None) -> bool:
    """Whether two lags that the data do not separate may be an oscillating pair."""
    if fit is None or fit.status is not FitStatus.DEGENERATE:
        return False
    return any(b < _CLOSE * a for a, b in itertools.pairwise(fit.time_constants))


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
