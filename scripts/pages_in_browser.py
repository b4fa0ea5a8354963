"""Whether every page that pamsim writes is whole and accessible, on a screen and on a phone.

    python scripts/pages_in_browser.py [--pages out/pages] [--pictures FOLDER] [--json FILE]

Needs Chromium, and ``pip install pyarrow playwright axe-playwright-python``. Commands that write
pages run into one folder, unless it is there; then each page is shown 1280 and 390 px wide, light
and dark, all that folds open.
In the record are, for each: how far the page is wider than the window [px], elements whose content
is cut off at their edge without a way to scroll, and what axe-core finds; and for each page its
figures, as PNG and as SVG. Exits 1 if anything is cut off or found.
"""

from __future__ import annotations

import itertools
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, sync_playwright
from records import head, parser, write

import pamsim

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
WIDTHS, SCHEMES = (1280, 390), ("light", "dark")
MAP = Path(pamsim.__file__).parent / "data" / "dmsp20_300_force_map.csv"
MADE = {
    "demo": "demo --no-open --out demo",
    "reproduce": "reproduce --out reproduce",
    "replicate": "replicate --out replicate",
    "step": "step --pressure 400,0 --load 1.2kg --out step",
    "fit": "fit map.csv --model six_parameter --nominal-length 300mm --out fit",
    "sweep": "sweep study.toml --out sweep",
    "identify": "identify step --out identify",
    "check": "check demo/recording --out check",
    "calibrate": "calibrate demo/recording --free joint.shaft.damping --out calibrate",
    "diagnose": "diagnose demo/recording --effects viscous_friction,air_leak --out diagnose",
}
"""Name -> arguments of ``pamsim``; later ones read what earlier ones wrote."""

STUDY = """
schema = "pamsim-sweep/1"
rig = "mas20_arm"
design = "sobol"
runs = 32
[experiment]
drive = "pressure_set"
start_pressure = [300, 300]
final = [300, 100]
duration = 1.0
[vary.load]
low = 0
high = 2
unit = "kg"
[vary."joint.shaft.damping"]
low = 0.1
high = 1.0
unit = "N*m*s/rad"
"""

CUT = """() => [...document.querySelectorAll('body *')].filter(each => {
  const style = getComputedStyle(each);
  const hides = ['hidden', 'clip'].includes(style.overflowX);
  return hides && each.scrollWidth > each.clientWidth + 1 && each.clientWidth > 1;
}).map(each => each.tagName + '.' + each.className)"""
UNFOLD = "() => document.querySelectorAll('details').forEach(each => { each.open = true; })"
WIDER = "() => document.documentElement.scrollWidth - window.innerWidth"


def make(folder: Path) -> None:
    """Run the commands that write pages."""
    folder.mkdir(parents=True)
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    shutil.copyfile(MAP, folder / "map.csv")
    for line in MADE.values():
        print(line, flush=True)
        done = subprocess.run(
            [sys.executable, "-m", "pamsim", *line.split()], cwd=folder, check=False
        )
        if done.returncode not in (0, 1):
            raise SystemExit(f"pamsim {line} failed")


def seen(page: Page, file: Path, width: int, scheme: Any) -> dict[str, Any]:
    """What is wrong with a page in a window."""
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme=scheme)
    page.goto(file.resolve().as_uri())
    page.wait_for_load_state("load")
    page.evaluate(UNFOLD)
    broken = Axe().run(page).response["violations"]
    return {
        "width_px": width,
        "scheme": scheme,
        "wider_px": max(0, page.evaluate(WIDER)),
        "cut_off": sorted(set(page.evaluate(CUT))),
        "axe": {one["id"]: [node["target"] for node in one["nodes"]][:3] for one in broken},
    }


def main() -> None:
    """Run, print, write."""
    asked = parser(__doc__)
    asked.add_argument("--pages", type=Path, default=Path("out/pages"))
    asked.add_argument("--pictures", type=Path)
    options = asked.parse_args()
    if not options.pages.exists():
        make(options.pages)
    files = sorted(options.pages.rglob("*.html"))
    result = head("python scripts/pages_in_browser.py") | {"pages": {}}
    bad = 0
    with sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        page = browser.new_page()
        for file in files:
            name = str(file.relative_to(options.pages))
            rows: list[dict[str, Any]] = []
            png, svg = (len(list(file.parent.glob(f"*.{kind}"))) for kind in ("png", "svg"))
            result["pages"][name] = {"png": png, "svg": svg, "views": rows}
            for width, scheme in itertools.product(WIDTHS, SCHEMES):
                row = seen(page, file, width, scheme)
                rows.append(row)
                if row["wider_px"] or row["cut_off"] or row["axe"]:
                    bad += 1
                    print(name, row, flush=True)
                if options.pictures is not None:
                    options.pictures.mkdir(parents=True, exist_ok=True)
                    picture = f"{name.replace('/', '_')}_{width}_{scheme}.png"
                    page.screenshot(path=options.pictures / picture, full_page=True)
        browser.close()
    write(result, options.json)
    print(f"{bad} of {4 * len(files)} views have something cut off or found")
    sys.exit(int(bad > 0))


if __name__ == "__main__":
    main()
