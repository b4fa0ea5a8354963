"""How large an effect that is not claimed could be without the data showing it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class AbsentBound:
    """What the data say of an effect that is not claimed.

    Attributes:
        effect: its name.
        parameter: that measures its size, under the rig's name.
        size: largest that the data could have missed, in units of the effect's typical one.
        limit: the same as a distance of the parameter from neutral [SI].
        visible: False if the data cannot show it at any size.
    """

    effect: str
    parameter: str
    size: float
    limit: float
    visible: bool
