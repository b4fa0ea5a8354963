"""What all runs of the public identifier SIPPY share: quiet estimation and the page of results.

Imported by scripts that run in an environment of their own, with sippy-unipi and without pamsim.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import io
import json
import platform
from pathlib import Path
from typing import Any

from sippy_unipi import system_identification


def estimate(u: Any, y: Any, interval: float, options: dict[str, Any]) -> Any:
    """SIPPY's model of one record, without its prints; None if SIPPY raises."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return system_identification(y, u, tsample=interval, **options)
    except Exception as error:  # a peer's failure is a result, not an end
        print(f"{options['id_method']}: {error!r}")
        return None


def write_page(path: Path, command: str, digest: str, found: dict[str, Any]) -> None:
    """Write the results with the command, the versions and the fingerprint of the records."""
    page = {
        "command": command,
        "versions": {
            "python": platform.python_version(),
            **{k: importlib.metadata.version(k) for k in ("sippy-unipi", "casadi", "numpy")},
        },
        "records_sha256": digest,
        **found,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(page, indent=1) + "\n", encoding="utf-8")
