"""What the control of a muscle means, and its code in the slot ``command`` of the parameter row."""

from __future__ import annotations

COMMANDS: tuple[str, ...] = ("valve", "pulse", "pressure_set", "measured")
"""What the control of the actuator means: a signed opening, a signed duty, the set point of a
regulator, or the gauge pressure that the chamber has after the time step, whatever valves and air
would do."""

VALVE, PULSE, PRESSURE_SET, MEASURED = (float(code) for code in range(len(COMMANDS)))
