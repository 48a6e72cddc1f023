"""HTML pages from templates (`flarewright/templates/*.html.j2`), without scripts and external files."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

from .png import png_address

if TYPE_CHECKING:
    from jinja2 import Environment


def html_page(template: str, **values: Any) -> str:
    """Fill in a template.

    Parameters
    ----------
    template : str
        Name of the file, without `.html.j2`.
    values
        By the names that the template uses. Texts are escaped; objects with a method `__html__`, such as
        `render.plots.svg.Chart`, are inserted as HTML.

    Returns
    -------
    str
        HTML: a page, or a section of one. A template that receives a section does not escape it again.
    """
    from markupsafe import Markup

    return Markup(_environment().get_template(f"{template}.html.j2").render(values))


@lru_cache(maxsize=1)
def _environment() -> Environment:
    # imported late: most commands write no page
    from jinja2 import Environment, PackageLoader, StrictUndefined

    made = Environment(
        loader=PackageLoader("flarewright"), autoescape=True, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True, undefined=StrictUndefined,
    )  # fmt: skip
    made.filters["png_address"] = png_address
    return made
