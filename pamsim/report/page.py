"""What every page shares: its schema, its files, its images, and how templates are filled.

A template is given the result itself and writes its numbers with filters, so that no code between
result and page repeats the result's fields. The filters are the functions of
`pamsim.report.numbers`::

    {{ row.after | significant(3) }}             0.0123
    {{ result.seconds | fixed(1) }}              12.3
    {{ result.seed | plain }}                    0
    {{ p.value | quantity(p.unit, 4) }}          487.0 kPa
    {{ p.interval95 | interval(4) }}             486.1 to 487.9
    {{ p.unit | unit }}                          N·m·s
    {{ effect.explained | percent }}             93 %
    {{ effect.p_value | p_value }}               < 0.0001
    {{ effect.p_value | p_is(least) }}           p ≤ 0.00098
    {{ effect.name | words }}                    coulomb friction
    {{ result.reason | sentence }}               No parameter at a limit.

What is missing (None) is written as a dash, a missing interval as nothing:
``{{ p.interval95 | interval(4) or "no interval" }}``.
"""

from __future__ import annotations

import base64
import functools
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
from matplotlib.figure import Figure
from PIL import Image

from pamsim.core.errors import InputError
from pamsim.core.files import complete_file, refuse_file
from pamsim.report.numbers import FILTERS
from pamsim.report.style import readable_panels, save_png, save_vectors


class PageImage(NamedTuple):
    """An image of the page, to be shown at a width and height [CSS pixel].

    ``source`` is the file's content as the address of an image, so that a page is one file;
    ``panels`` are those of `readable_panels`.
    """

    source: str
    width: int
    height: int
    panels: list[Any]


def page_image(figure: Figure, path: Path) -> PageImage:
    """Write a figure into a PNG, with SVG and PDF beside it, and make it an image of a page.

    Raises:
        InputError: if the place cannot be written.
    """
    width, height = save_png(figure, path)
    figure.set_layout_engine("none")  # the PNG's holds for all: it takes longer than to draw
    save_vectors(figure, path)
    content = io.BytesIO()
    with Image.open(path) as image:  # with 256 colours a third of the size
        image.convert("RGB").quantize(dither=Image.Dither.NONE).save(content, "png", optimize=True)
    source = inline_image(content.getvalue(), "png")
    return PageImage(source, width, height, readable_panels(figure))


def inline_image(content: bytes, kind: str) -> str:
    """The content of an image file, such as ``gif``, as the address of an image."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


@functools.cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("pamsim.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,  # a name mistyped in the template is an error
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update({one.__name__: one for one in FILTERS})
    return environment


def page_template(name: str) -> jinja2.Template:
    """A template of the folder ``templates``; every text put into it is escaped."""
    return _environment().get_template(name)


def write_page(
    out: Path,
    template: str,
    result: Mapping[str, Any],
    draw: Callable[[], Mapping[str, Figure]],
    *,
    schema: str,
    **more: Any,
) -> Path:
    """Write the page of a result, which holds its figures, and these as PNG, SVG and PDF beside it.

    It returns the place of the page.

    Args:
        out: folder; made if missing, files of the same names are replaced.
        template: file in ``templates``. It is given ``result``; ``images`` (name -> `PageImage`)
            and ``numbers`` (name -> ``Figure 1`` ...) of the figures drawn; and ``more``.
        result: JSON-safe, as the command writes it.
        draw: returns the figures, by the names of their files without ``.png``.
        schema: that the page was made for.
        more: what the template needs beside the result.

    Raises:
        InputError: if the result has another schema, or the place is a file or cannot be written.
    """
    if result.get("schema") != schema:
        raise InputError(
            f"the result has schema {result.get('schema')!r}; this page reads {schema!r}"
        )
    refuse_file(out)
    images = {name: page_image(figure, out / f"{name}.png") for name, figure in draw().items()}
    numbers = {name: f"Figure {number}" for number, name in enumerate(images, 1)}
    text = page_template(template).render(result=result, images=images, numbers=numbers, **more)
    page = out / "index.html"
    with complete_file(page) as part:
        part.write_text(text, encoding="utf-8")
    return page
