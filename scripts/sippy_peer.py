"""What all runs of the public identifier SIPPY share: quiet estimation and the page of results.

Imported by scripts that run in an environment of their own, with sippy-unipi and without pamsim.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.metadata
import io
import json
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from sippy_unipi import system_identification


def estimate(u: Any, y: Any, interval: float, options: dict[str, Any]) -> Any:
    """SIPPY's model of one record, without its prints; None if SIPPY raises."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return system_identification(y, u, tsample=interval, **options)
    except Exception as error:  # a peer's failure is a result, not an end
        print(f"{options['id_method']}: {error!r}")
        return None


def study(
    description: str, name: str, records: str, estimates: Callable[[Any], dict[str, Any]]
) -> None:
    """Read the records of a study, estimate, and write the results with what they hang on.

    Args:
        description: of the script.
        name: of the script and its record.
        records: file of the records, as in the command.
        estimates: arrays of the records to results.
    """
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("records", type=Path)
    target = Path(__file__).parent / "results" / f"{name}.json"
    parser.add_argument("--json", type=Path, default=target)
    options = parser.parse_args()
    arrays = np.load(options.records)
    page = {
        "command": "OMP_NUM_THREADS=1 PYTHONPATH=. <venv with sippy-unipi>/bin/python"
        f" scripts/{name}.py {records}",
        "versions": {
            "python": platform.python_version(),
            **{k: importlib.metadata.version(k) for k in ("sippy-unipi", "casadi", "numpy")},
        },
        "records_sha256": str(arrays["digest"]),
        **estimates(arrays),
    }
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(page, indent=1) + "\n", encoding="utf-8")
