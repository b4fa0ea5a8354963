"""A run of the compiled kernel, which its laws in Python repeat."""

import sys

import numpy as np

import pamsim


def both_backends(rig, experiment, exact=True):
    """The compiled run, once it is that in Python, to the bit or, where asked, to rounding."""
    fast, slow = (
        pamsim.simulate(rig, experiment, backend=backend).completed()
        for backend in ("compiled", "python")
    )
    for name in ("positions", "velocities", "pressure", "tension"):
        one, other = getattr(fast, name), getattr(slow, name)
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12, err_msg=name)
    if sys.platform == "linux":  # there both call one mathematics library
        relative = 0.0 if exact else 1e-12
        np.testing.assert_allclose(fast.final_state, slow.final_state, rtol=relative)
    return fast
