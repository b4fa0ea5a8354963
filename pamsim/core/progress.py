"""How a long computation reports where it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, "int | None", str], None]
"""Called as ``progress(done, total, what)``: steps done, of how many (None if unknown), and what is
being done now."""


class Steps:
    """Reports the steps of a computation whose number becomes known on the way."""

    def __init__(self, progress: Progress | None, ahead: int) -> None:
        """Begin.

        Args:
            progress: called as each step begins.
            ahead: steps expected, at most.
        """
        self._progress, self._done, self._total = progress, 0, ahead

    def expect(self, ahead: int) -> None:
        """Correct how many steps are still ahead, at most."""
        self._total = self._done + ahead

    def begin(self, what: str) -> None:
        """Report that a step begins."""
        if self._progress is not None:
            self._progress(self._done, max(self._total, self._done + 1), what)
        self._done += 1
