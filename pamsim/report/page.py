"""What every page shares: its schema, its files, its images, and how templates are filled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
from matplotlib.figure import Figure

from pamsim.core.errors import InputError
from pamsim.report.style import save_png


@dataclass(frozen=True)
class PageImage:
    """An image file of the page and the size to show it at [CSS pixel]."""

    file: str
    width: int
    height: int


def page_template(name: str) -> jinja2.Template:
    """A template of this room; every text put into it is escaped.

    Args:
        name: file in ``templates``.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("pamsim.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,  # a name mistyped in the template is an error, not a gap
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


def check_schema(result: Mapping[str, Any], schema: str) -> None:
    """Refuse a result that a page was not made for.

    Raises:
        InputError: if its schema is another.
    """
    if result.get("schema") != schema:
        raise InputError(
            f"the result has schema {result.get('schema')!r}; this page reads {schema!r}"
        )


def save_page(
    out: Path,
    draw: Callable[[], Mapping[str, Figure]],
    render: Callable[[Mapping[str, PageImage]], str],
) -> list[Path]:
    """Write a page and its figures.

    Args:
        out: folder; made if missing, files of the same names are replaced.
        draw: the figures, by the names of their files without ``.png``.
        render: the page's text, from the images of those names.

    Returns:
        The files written, the page first.

    Raises:
        InputError: if the place is a file, or cannot be written.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; name a folder to write the page into")
    images: dict[str, PageImage] = {}
    page = out / "index.html"
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, figure in draw().items():
            images[name] = PageImage(f"{name}.png", *save_png(figure, out / f"{name}.png"))
        page.write_text(render(images), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {out}: {error.strerror}") from None
    return [page, *(out / image.file for image in images.values())]
