"""``pamsim reproduce``: all printed MAS-20 experiments against the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, exit_code, progress_bar, save_json, show_page


@click.command(name="reproduce", cls=Command)
@options.rig
@click.option(
    "--from",
    "start",
    default="vent",
    shell_complete=options.listed("pamsim.papers.printed_steps", "STARTS"),
    help="Assumed start of the steps: vent, fill or maximum (see the page for their meaning).",
)
@options.timestep
@click.option("--sensors", is_flag=True, help="Record through the rig's encoder and converter.")
@options.page("Folder for page, figures and CSV.")
def command(rig: str, out: Path | None, json_file: Path | None, **choices: Any) -> int:
    """Simulate every printed MAS-20 experiment, compare the end positions, identify G1 and G2."""
    from pamsim.papers.reproduce import reproduce

    with progress_bar() as progress:
        reproduction = reproduce(rig, progress=progress, **choices)
    result = reproduction.to_dict()
    save_json(json_file, result)
    _print(result)
    answer(reproduction.summary())
    if out is not None:
        from pamsim.report.reproduce_page import write_reproduction

        show_page(write_reproduction(result, reproduction.recordings, out))
    return exit_code(all(check.ok for check in reproduction.checks))


def _print(result: dict[str, Any]) -> None:
    click.echo("row   p1     p2   load   measured simulated   error")
    click.echo("      kPa    kPa    kg        deg       deg      deg")
    for row in result["rows"]:
        simulated = row["simulated_deg"]
        end = (
            f"{simulated:9.2f} {row['error_deg']:8.2f}" if simulated is not None else row["outcome"]
        )
        again = f"  = row {row['repeats']}" if row["repeats"] else ""
        click.echo(
            f"{row['row']:3d} {row['p1_kpa']:6.0f} {row['p2_kpa']:6.0f} {row['load_kg']:5.2f}"
            f" {row['measured_deg']:9.2f} {end}{again}"
        )
    for check in result["checks"]:
        mark = "ok  " if check["ok"] else click.style("FAIL", fg="red")
        click.echo(f"{mark} {check['sentence']}")
    if result["g2"] is not None:
        g1, g2, paper = result["g1"], result["g2"], result["paper"]
        click.echo("models of the large step (row 1)     G1: T     G2: T1       T2")
        for first, second in (
            (g1, g2),
            (g1["arx"]["unit_gain"], g2["arx"]["unit_gain"]),
            (g1["arx"]["free_gain"], g2["arx"]["free_gain"]),
            ({**paper["g1"], "method": "printed, (30) and (31)"}, paper["g2"]),
        ):
            constants = (first["T_s"], second["T1_s"], second["T2_s"])
            click.echo(f"  {first['method']:30s}" + "".join(map(_seconds, constants)))
        click.echo(f"G2 by output error fits the simulated step to {result['fit_percent']:.1f} %")


def _seconds(value: float | None) -> str:
    return "     none" if value is None else f"{value:7.4f} s"
