"""Steps whose number becomes known on the way."""

from __future__ import annotations

from pamsim.core.progress import Steps


def test_steps_are_counted_and_the_total_is_never_behind():
    seen = []
    steps = Steps(lambda *now: seen.append(now), 3)
    for what in "ab":
        steps.begin(what)
    steps.expect(1)
    for what in "cd":
        steps.begin(what)
    assert seen == [(0, 3, "a"), (1, 3, "b"), (2, 3, "c"), (3, 4, "d")]
