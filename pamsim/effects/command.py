"""Effects between command and valves: delay, lag and limited speed."""

from __future__ import annotations

from pamsim.effects.effect import Effect, size

EFFECTS = (
    Effect(
        link="command", family="command_delay", name="valve_delay",
        missing="a delay before the valves act",
        equation="u_valve(t) = u(t - delay)",
        parameters=(size("valve.delay", 0.01, 0.0, 0.1),),
        look_alikes=("line_lag", "pressure_lag"),
        separating="sharp steps at a high sampling rate: a delay stays flat first",
        upstream_of_pressure=True,
    ),
    Effect(
        link="command", family="command_delay", name="valve_closing",
        missing="valves that close later than they open",
        equation="u_valve(t) = u(t - delay - closing_delay) where |u| gets smaller",
        parameters=(size("valve.closing_delay", 0.01, 0.0, 0.1),),
        look_alikes=("valve_delay", "valve_slew", "valve_flow"),
        separating="pulses of several lengths: late closing lengthens each by the same time",
        upstream_of_pressure=True, rare=True,
    ),
    Effect(
        link="command", family="command_delay", name="line_lag", form="first_order",
        missing="a lag between the command and the valves",
        equation="tau u_valve' = u - u_valve",
        parameters=(size("valve.line_lag", 0.02, 0.0, 0.5),),
        look_alikes=("valve_delay", "pressure_lag", "valve_flow"),
        separating="sharp steps at a high sampling rate: a lag responds at once",
        upstream_of_pressure=True,
    ),
    Effect(
        link="command", family="command_delay", name="line_lag", form="limited_rate",
        missing="a limit on the rate of the command that reaches the valves",
        equation="u_valve' = (u - u_valve) / tau, |u_valve'| <= 1 bar / t_slew of set points, 1 /"
        " t_slew of openings",
        parameters=(
            size("valve.line_slew_time", 0.03, 0.0, 1.0),
            size("valve.line_lag", 2e-3, 0.0, 0.5),
        ),
        look_alikes=("valve_delay", "valve_slew", "valve_flow"),
        separating="steps of different height: with a limited rate higher steps take"
        " longer, with a lag the same time",
        upstream_of_pressure=True,
    ),
    Effect(
        link="command", family="command_delay", name="valve_slew",
        missing="a limit on the speed at which the valves open and close",
        equation="|u_valve'| <= 1 / travel_time",
        parameters=(size("valve.travel_time", 0.03, 0.0, 1.0),),
        look_alikes=("line_lag", "valve_delay", "valve_flow"),
        separating="steps of different size: a slow valve takes longer to open further,"
        " a lag takes the same time",
        probes=(0.1, 0.5, 2.0), upstream_of_pressure=True, rare=True,
    ),
)  # fmt: skip
