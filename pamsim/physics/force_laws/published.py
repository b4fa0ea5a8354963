"""Published constants of the six-parameter force law, in SI; printed for bar, percent and N."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from pamsim.core.units import PA_PER_BAR
from pamsim.physics.force_laws.exponential import SixParameter

_PRINTED = {
    # Later work of Sarosi's group, of the type that Sarosi measured; Sarosi prints none.
    "DMSP-20-200": (-4.00180705, 292.4620246, -0.32930845, -9.33564098, 294.0538256, -280.498151),
    # Later work of the group of Sarosi.
    "DMSP-20-400": (-4.35573, 281.22370, -0.32866, -9.27035, 302.20107, -263.69185),
    # Group of Sarosi, quoted second-hand.
    "DMSP-10": (-9.2194029, 203.7012413, -0.34221042, -3.2255991, 109.2038216, -208.372034),
}
"""a [N/bar], b [N], c [1/%], d [N/(bar %)], e [N/bar], f [N]."""

PUBLISHED: Mapping[str, SixParameter] = MappingProxyType(
    {
        muscle: SixParameter(
            a=a / PA_PER_BAR, b=b, c=c * 100.0, d=d * 100.0 / PA_PER_BAR, e=e / PA_PER_BAR, f=f
        )
        for muscle, (a, b, c, d, e, f) in _PRINTED.items()
    }
)
"""Six-parameter laws by the type of the Festo muscle."""
