"""Printed numbers of the papers as their files hold them, read without the package's readers."""

import csv
import tomllib
from importlib.resources import files

_FOLDER = files("pamsim") / "data"


def printed(paper):
    """Name -> printed number or numbers of ``<paper>.toml``, in the printed unit."""
    entries = tomllib.loads((_FOLDER / f"{paper}.toml").read_text(encoding="utf-8"))["number"]
    return {name: entry["value"] for name, entry in entries.items()}


def rows(file):
    """Rows of a printed table, column -> text."""
    lines = (_FOLDER / file).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def column(table, name):
    """One column as numbers."""
    return [float(row[name]) for row in table]
