"""numba with a cache that mends itself.

What a killed process or a full disk has left of a file of compiled code would otherwise end every
later run in a traceback of numba's.
"""

from __future__ import annotations

from typing import Any

import numba
from numba.core import caching

_Files: Any = caching.IndexDataCacheFile
_load: Any = _Files.load


def _load_whole(self: Any, key: Any) -> Any:
    """As numba's own; nothing, so that it compiles again, where a file cannot be read."""
    try:
        return _load(self, key)
    except Exception:  # pickle states no list of what damaged bytes raise
        self.flush()
        return None


_Files.load = _load_whole

__all__ = ["numba"]
