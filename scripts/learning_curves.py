"""Draw docs/images/learning_curves.svg: how the policies of the documents were trained.

    python scripts/learning_curves.py

The curves are those of the committed records of `pamsim train`, `results/policy_*.json`.
"""

from __future__ import annotations

from pathlib import Path

from pictures import DOCUMENTS, GREY, on_any_ground, save_small_svg
from records import RESULTS, read

from pamsim.report.style import finish_axes, new_figure, page_style
from pamsim.scene.series_colours import BLUE, GREEN, VERMILION

PICTURE = DOCUMENTS / "learning_curves.svg"
COLOURS = {"policy_sine": BLUE, "policy_step": GREEN, "policy_two_joint": VERMILION}


def draw(path: Path) -> None:
    """Mean reward of an episode over the steps taken, a line for each record."""
    with page_style():
        figure, (axes,) = new_figure(2.6, width_in=5.2)  # read on a phone as well
        for name, colour in COLOURS.items():
            record = read(RESULTS / f"{name}.json")
            curve, settings = record["curve"], record["settings"]
            label = f"{settings['rig']}, {settings['task']}"
            steps = [count / 1e3 for count in curve["steps"]]
            axes.plot(steps, curve["mean_episode_reward"], color=colour, label=label)
        finish_axes(axes, x="steps of all 32 rigs [thousand]", y="mean reward of an episode [-]")
        on_any_ground(figure, axes)
        axes.legend(loc="lower right", frameon=False, labelcolor=GREY)
    save_small_svg(figure, path)


if __name__ == "__main__":
    draw(PICTURE)
