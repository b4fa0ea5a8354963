"""A run of the compiled kernel, which its laws in Python repeat."""

import sys

import numpy as np

import pamsim


def both_backends(rig, experiment):
    """The compiled run, after it has been compared with that in Python."""
    fast, slow = (
        pamsim.simulate(rig, experiment, backend=backend).completed()
        for backend in ("compiled", "python")
    )
    for name in ("positions", "velocities", "pressure", "tension"):
        one, other = getattr(fast, name), getattr(slow, name)
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12, err_msg=name)
    if sys.platform == "linux":  # there both call one mathematics library
        assert np.array_equal(fast.final_state, slow.final_state)
    return fast
