r"""N4SID and scipy's least squares on the records of identify_literature.py, scored by its rule.

    OMP_NUM_THREADS=1 PYTHONPATH=. <venv with sippy-unipi>/bin/python \
        scripts/identify_literature_peers.py out/identify_literature.npz

Runs in an environment of its own, with sippy-unipi; of pamsim it imports the fit percent alone.

N4SID is SIPPY's, orders 1 to 8, with horizons of 20 (its default) and 40 samples. Output error has
orders 1 to 6: least_squares searches the polynomial F of the poles, and in every step b, a
constant and the initial state follow by linear least squares. It starts at ARX, at the best of
ten rounds of Steiglitz and McBride's from there, at N4SID's poles of the same order and at the
order below; the best end counts. F is kept stable by reflecting its roots. Both are given the
records less their means, and fitted without and with a direct term (an effect of the input within
the same sample).
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from free_runs import free_responses, grows, started_freely
from scipy.optimize import least_squares
from scipy.signal import dlsim, lfilter, tf2ss
from sippy_peer import estimate, study

from pamsim.core.units import FloatArray
from pamsim.identification.records import fit_percent

N4SID_ORDERS, HORIZONS = range(1, 9), (20, 40)
OE_ORDERS = range(1, 7)
ROUNDS = 10  # of Steiglitz and McBride


def shifted(x: FloatArray, shifts: range) -> FloatArray:
    """Columns of x, each later by so many samples, shape ``(N, len(shifts))``."""
    return np.column_stack([np.append(np.zeros(k), x[: x.size - k]) for k in shifts])


def stable(f: FloatArray) -> FloatArray:
    """The polynomial 1, f1..fn with its roots reflected into the unit circle."""
    roots = np.roots(np.append(1.0, f))
    outside = np.abs(roots) > 1.0
    roots[outside] = 1.0 / np.conj(roots[outside])
    return np.real(np.poly(roots))


def arx(u: FloatArray, y: FloatArray, order: int, direct: bool) -> FloatArray:
    """Denominator f1..fn of least squares on the equation error."""
    past_y, past_u = shifted(y, range(1, order + 1)), shifted(u, range(1 - direct, order + 1))
    rows = np.hstack([-past_y, past_u])[order:]
    return np.linalg.lstsq(rows, y[order:], rcond=None)[0][:order]


def steiglitz_mcbride(u: FloatArray, y: FloatArray, f: FloatArray, direct: bool) -> list[Any]:
    """Denominators f1..fn of ten rounds: ARX of the record filtered by the last denominator."""
    found: list[Any] = []
    for _ in range(ROUNDS):
        below = stable(f)
        f = arx(lfilter([1.0], below, u), lfilter([1.0], below, y), f.size, direct)
        found.append(f)
    return found


def output_error(u: FloatArray, y: FloatArray, direct: bool, starts: list[Any]) -> Any:
    """Numerator and denominator, from further starts f1..fn beside those of the equation error."""
    order, scale = starts[0].size, float(np.std(y))

    def linear_part(f: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        below = stable(f)
        forced = shifted(lfilter([1.0], below, u), range(1 - direct, order + 1))
        columns = np.hstack([forced, free_responses(np.roots(below), y.size)])
        found = np.linalg.lstsq(columns, y, rcond=None)[0]
        return (columns @ found - y) / scale, found[: forced.shape[1]], below

    def error(f: FloatArray) -> float:
        return float(np.sum(linear_part(f)[0] ** 2))

    first = arx(u, y, order, direct)
    starts = [*starts, first, min(steiglitz_mcbride(u, y, first, direct), key=error)]
    ends = [least_squares(lambda f: linear_part(f)[0], f, x_scale="jac").x for f in starts]
    _, above, below = linear_part(min([*starts, *ends], key=error))
    return above, below


def models(u: FloatArray, y: FloatArray, interval: float) -> Iterator[tuple[str, str, Any]]:
    """Method, label and state-space matrices (None if it failed) of every model of one record."""
    for direct in (False, True):
        ending, starts = ", D" if direct else "", defaultdict[int, list[FloatArray]](list)
        for horizon in HORIZONS:
            fixed = {"SS_f": horizon, "SS_p": horizon, "SS_D_required": direct}
            for order in N4SID_ORDERS:
                options = {"id_method": "N4SID", "SS_fixed_order": order, **fixed}
                model = estimate(u, y, interval, options)
                if model is not None:
                    starts[order].append(np.real(np.poly(model.A))[1:])
                matrices = None if model is None else (model.A, model.B, model.C, model.D)
                yield "N4SID", f"{order}, horizon {horizon}{ending}", matrices
        below = np.ones(1)
        for order in OE_ORDERS:
            nested = np.append(below[1:], 0.0)
            above, below = output_error(u, y, direct, [nested, *starts[order]])
            yield "OE", f"{order}{ending}", tf2ss(above, below)


def scores(fitted: Sequence[FloatArray], scored: Sequence[FloatArray], interval: float) -> Any:
    """Fit percent of every model on the scored half, by method, and the seconds it all took.

    Args:
        fitted: input and output of the first half.
        scored: of the second half.
        interval: sampling time [s].

    Returns:
        Method -> "seconds", "failed" labels, and "stable" and "unstable": label -> fit [%].
    """
    u, y = (column - np.mean(column) for column in fitted)
    given, output = scored[0] - np.mean(fitted[0]), scored[1]
    table: dict[str, Any] = {
        method: {"seconds": 0.0, "failed": [], "stable": {}, "unstable": {}}
        for method in ("N4SID", "OE")
    }
    began = time.perf_counter()
    for method, label, matrices in models(u, y, interval):
        entry = table[method]
        entry["seconds"] += time.perf_counter() - began
        if matrices is None:
            entry["failed"].append(label)
        else:
            poles = np.linalg.eigvals(matrices[0])
            with np.errstate(over="ignore", invalid="ignore"):
                forced = dlsim((*matrices, 1.0), given)[1][:, 0]
            score = fit_percent(output, started_freely(forced, poles, output))
            kind = "unstable" if grows(poles, output.size) else "stable"
            entry[kind][label] = score if np.isfinite(score) else None
        began = time.perf_counter()
    return table


def estimates(arrays: Any) -> dict[str, Any]:
    """Fit and score all records."""
    sets: dict[str, Any] = {}
    for name in [key.removesuffix("|interval") for key in arrays if key.endswith("|interval")]:
        first, second = arrays[f"{name}|first"], arrays[f"{name}|second"]
        sets[name] = scores(first, second, float(arrays[f"{name}|interval"]))
        print(f"{name}: {sum(row['seconds'] for row in sets[name].values()):.0f} s", flush=True)
    return {"sets": sets}


if __name__ == "__main__":
    study(__doc__, "identify_literature_peers", "out/identify_literature.npz", estimates)
