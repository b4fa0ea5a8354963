"""What models have in common that predict as well as the best one."""

from __future__ import annotations

from collections.abc import Sequence


def shared_names(models: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Effects that are in every one of some models."""
    if not models:
        return ()
    return tuple(name for name in models[0] if all(name in names for names in models))
