"""What tests of the documents read: pages, records of the scripts, and the scripts themselves."""

import json
import runpy
import sys
from pathlib import Path
from types import SimpleNamespace

ROOT = Path(__file__).parents[1]
SCRIPTS = ROOT / "scripts"


def recorded(name):
    """A record below ``scripts``."""
    return json.loads((SCRIPTS / f"{name}.json").read_text(encoding="utf-8"))


def page(name):
    """Lines of a page of the documents."""
    return (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")


def words(name):
    """A page of the documents on one line."""
    return " ".join(page(name).split())


def quoted(name, *sentences):
    """See that a page of the documents has sentences, over whatever lines."""
    for sentence in sentences:
        assert " ".join(sentence.split()) in words(name), sentence


def script(name):
    """The names of a script below ``scripts``, which may import its neighbours."""
    path = SCRIPTS / f"{name}.py"
    sys.path.insert(0, str(path.parent))
    try:
        return SimpleNamespace(**runpy.run_path(str(path), run_name=path.stem))
    finally:
        sys.path.remove(str(path.parent))
