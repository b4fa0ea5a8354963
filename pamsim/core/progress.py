"""How a long computation reports where it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, "int | None", str], None]
"""Called as ``progress(done, total, what)``: runs done, of how many (None if unknown), and what is
being done now."""
