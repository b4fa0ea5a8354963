"""A page in a real browser: its script runs, it is one file, a phone shows it without scrolling."""

import re
import shutil
import subprocess

import pytest

from pamsim.report.link_page import headline, write_link_diagnosis
from tests.unit.diagnosis.by_link.reports import VERDICTS

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
PHONE = """<iframe src="page/index.html" width="390" height="844" onload="
  const page = this.contentDocument, images = [...page.querySelectorAll('figure img')];
  const image = images.find(each => each.dataset.panels !== '[]');
  const [x, y] = JSON.parse(image.dataset.panels)[0];
  const move = new PointerEvent('pointermove', {bubbles: true});
  const at = (axis, size) => size * (axis.from + axis.to) / 2;
  Object.defineProperty(move, 'offsetX', {value: at(x, image.offsetWidth)});
  Object.defineProperty(move, 'offsetY', {value: image.offsetHeight - at(y, image.offsetHeight)});
  image.dispatchEvent(move);
  const figure = image.closest('figure');
  figure.querySelector('button').click();
  document.body.dataset.wide = page.documentElement.scrollWidth;
  document.body.dataset.headline = page.getElementById('headline').textContent;
  document.body.dataset.read = figure.querySelector('output').value;
  document.body.dataset.middle = (x.low + x.high) / 2;
  document.body.dataset.drawn = image.naturalWidth;
  document.body.dataset.large = figure.className;
"></iframe>"""


@pytest.mark.skipif(BROWSER is None, reason="no Chromium")
def test_the_story_on_a_phone(tmp_path):
    one = VERDICTS["ambiguous"]
    write_link_diagnosis(one.to_dict(), one.comparisons, tmp_path / "page")
    for picture in (tmp_path / "page").glob("*.png"):
        picture.unlink()  # as after mailing the page alone
    (tmp_path / "phone.html").write_text(PHONE, encoding="utf-8")
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=9000",
               "--allow-file-access-from-files", f"--user-data-dir={tmp_path / 'profile'}",
               "--dump-dom", str(tmp_path / "phone.html")]  # fmt: skip
    shown = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    seen = dict(re.findall(r'data-(\w+)="(.*?)"', shown))
    assert seen["headline"] == headline(one.to_dict())
    assert int(seen["wide"]) <= 390
    assert int(seen["drawn"]) == 1440
    assert seen["large"] == "large"
    label, value = re.fullmatch(r"(time) (\S+) \[s\], .*", seen["read"]).groups()
    assert float(value) == pytest.approx(float(seen["middle"]), rel=0.01), label
