"""BLAS has one thread where it is told to; steps are counted."""

import numpy as np
import pytest
import threadpoolctl

from pamsim.core.computation import Steps, one_blas_thread


def threads():
    return {p["num_threads"] for p in threadpoolctl.threadpool_info() if p["user_api"] == "blas"}


def test_blas_has_one_thread_inside_and_what_it_had_afterwards():
    np.ones((2, 2)) @ np.ones((2, 2))
    with threadpoolctl.threadpool_limits(2, "blas"):
        if threads() != {2}:
            pytest.skip("this BLAS cannot have two threads")
        assert one_blas_thread()(threads)() == {1}
        with pytest.raises(ZeroDivisionError), one_blas_thread():
            raise ZeroDivisionError
        assert threads() == {2}


def test_steps_are_counted_and_the_total_is_never_behind():
    seen = []
    steps = Steps(lambda *now: seen.append(now), 3)
    for what in "ab":
        steps.begin(what)
    steps.expect(1)
    for what in "cd":
        steps.begin(what)
    assert seen == [(0, 3, "a"), (1, 3, "b"), (2, 3, "c"), (3, 4, "d")]
