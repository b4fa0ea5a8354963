r"""Estimates of the public identifier SIPPY on the records of scripts/identify_study.py.

    OMP_NUM_THREADS=1 <venv with sippy-unipi>/bin/python scripts/identify_peers.py \
        out/identify_peers.npz

Runs in an environment of its own: it imports SIPPY and nothing of pamsim. SIPPY is given the right
orders (two poles, two numerator coefficients, no extra delay) and the records less the mean output
of the 0.5 s of rest they begin with, since it has no offset in its models.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from sippy_peer import estimate, study

INTERVAL = 0.01
RESTING = 50  # samples before the input moves
METHODS: dict[str, dict[str, Any]] = {
    "SIPPY OE": {"id_method": "OE", "OE_orders": [2, 2, 0]},
    "SIPPY ARMAX (OPT)": {"id_method": "ARMAX", "ARMAX_orders": [2, 2, 2, 0], "ARMAX_mod": "OPT"},
    "SIPPY ARX": {"id_method": "ARX", "ARX_orders": [2, 2, 0]},
    "SIPPY N4SID": {"id_method": "N4SID", "SS_fixed_order": 2},
    "SIPPY CVA": {"id_method": "CVA", "SS_fixed_order": 2},
}


def time_constants(poles: Any) -> tuple[float, float] | None:
    """Rising time constants of two poles of sampled lags; None if they are no lags."""
    poles = np.asarray(poles, dtype=complex)
    if poles.size != 2 or np.any(np.abs(poles.imag) > 1e-9):
        return None
    if np.any(poles.real <= 0.0) or np.any(poles.real >= 1.0):
        return None
    fast, slow = sorted(float(-INTERVAL / np.log(z)) for z in poles.real)
    return fast, slow


def estimated(u: Any, y: Any, options: dict[str, Any]) -> dict[str, Any]:
    """Estimate one record; what SIPPY raises counts as a record without estimate."""
    began = time.perf_counter()
    model = estimate(u, y - np.mean(y[:RESTING]), INTERVAL, options)
    if model is None:
        estimates = None
    elif options["id_method"] in ("N4SID", "CVA"):
        estimates = time_constants(np.linalg.eigvals(model.A))
    else:
        estimates = time_constants(np.roots(np.ravel(model.G.den[0][0])))
    seconds = time.perf_counter() - began
    fast, slow = estimates or (None, None)
    return {"T1": fast, "T2": slow, "seconds": seconds}


def estimates(arrays: Any) -> dict[str, Any]:
    """All records by all methods."""
    names = [key.removesuffix("|u") for key in arrays if key.endswith("|u")]
    scenarios: dict[str, list[dict[str, Any]]] = {}
    for name in names:
        pairs = list(zip(arrays[f"{name}|u"], arrays[f"{name}|y"], strict=True))
        scenarios[name] = []
        for i, (u, y) in enumerate(pairs):
            scenarios[name].append({m: estimated(u, y, given) for m, given in METHODS.items()})
            print(f"{name}: {i + 1} of {len(pairs)}", flush=True)
    return {"scenarios": scenarios}


if __name__ == "__main__":
    study(__doc__, "identify_peers", "out/identify_peers.npz", estimates)
