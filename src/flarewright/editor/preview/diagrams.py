"""Diagrams beside the picture: cross-section, coating charts, colour maps, and the library's list."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...design.coatings.colors import indices_of, pair_map
from ...design.problem.ghosts import placed_ghosts
from ...design.problem.grey_picture import png_bytes
from ...design.problem.prescription import structure_of
from ...errors import ProjectError
from ...io.images.mask_image import read_mask
from ...io.lens.coating_text import format_coating
from ...io.lens.library import library_names
from ...io.lens.own.folder import key_of
from ...io.lens.own.record import LensRecord
from ...io.project.look_file import read_look, shipped_looks
from ...model import Coating, Project, Surface
from ...model.project.design import Bounds
from ...optics.coatings.response import WAVELENGTHS_NM, coating_response
from ...optics.lens.dispersion import refractive_index
from ...optics.rays.pack import resolve_coatings
from ...render.plots.coating_plot import PANEL, PLOT_ANGLES_DEG, STRIP_ANGLES_DEG, coating_figure
from ...render.plots.cross_section import cross_section
from ...render.plots.svg import to_svg
from ...render.scene.resolve import open_lens, resolve_project
from ...workflow.own_library.lens_record import shipped_records
from ...workflow.own_library.own_lenses import own_library
from .display_image import png


def mask_png(project: Project) -> bytes:
    """Return the mask of a project's iris as PNG, for the mask editor.

    Raises
    ------
    ProjectError
        When it has none, or the mask cannot be read.
    """
    iris = project.iris
    if iris is None or iris.mask is None:
        raise ProjectError("the iris has no mask; load or draw one")
    return png(np.round(255.0 * read_mask(iris.mask)).astype(np.uint8))


@dataclass(frozen=True)
class Section:
    """A cross-section as SVG; `remark` says why rays of the ghost are missing, if they are."""

    svg: str
    remark: str = ""


def cross_section_diagram(project: Project, ghost: str | None) -> Section:
    """Draw the lens with rays of the light, or of a ghost."""
    settled = resolve_project(project)
    names = () if ghost is None else tuple(ghost.split("-"))
    pair = None
    if len(names) == 2:
        j, i = names
        pair = len(settled.lens.rows) if j == "sensor" else int(j), int(i)
    angle = max(project.lights, key=lambda light: light.intensity).field_deg
    drawn = cross_section(settled.lens, settled.order, field_deg=angle, ghost=pair, iris=settled.iris)
    if len(names) > 2:
        return Section(drawn.svg, "four reflections, whose rays are not drawn")
    missing = pair is not None and any("the ghost" in remark for remark in drawn.remarks)
    return Section(drawn.svg, "no ray of it lies in this plane" if missing else "")


def coating_svg(project: Project, row: int) -> str:
    """Plot the reflectance of the coating of a row."""
    lens = open_lens(project.lens).lens
    if not 0 <= row < len(lens.rows) or not isinstance(lens.rows[row], Surface):
        raise ProjectError(f"row {row} is no surface, so it has no coating")
    coat: Coating | None = resolve_coatings(lens, project.coating)[row]
    surface, before = lens.rows[row], lens.rows[row - 1] if row else None
    assert isinstance(surface, Surface)
    medium = surface.medium or (before.medium if isinstance(before, Surface) else None)
    if medium is None:
        raise ProjectError(f"row {row} has air on both sides, so it has no coating")
    index = refractive_index(medium, WAVELENGTHS_NM)
    glass, front = medium.glass or f"n = {medium.n_d:g}", (1.0, np.ones_like(index))
    if surface.medium is not None and isinstance(before, Surface) and before.medium is not None:
        # cemented: light comes from glass
        front = before.medium.n_d, refractive_index(before.medium, WAVELENGTHS_NM)
        glass += f" behind {before.medium.glass or f'n = {before.medium.n_d:g}'}"
    curves = coating_response(coat, medium.n_d, index, PLOT_ANGLES_DEG, front)
    strip = coating_response(coat, medium.n_d, index, STRIP_ANGLES_DEG, front)
    bare = float(coating_response(None, medium.n_d, index, 0.0, front).luminous_reflectance[0])
    name = "no coating" if coat is None else format_coating(coat)
    return to_svg(coating_figure(curves, strip, bare, f"Row {row}: {name}", glass, PANEL))


def colour_map(project: Project, ghost: str) -> bytes:
    """Draw the colour of a ghost as a function of the centre wavelengths of its two mirrors' coatings; PNG.

    First mirror upwards, second to the right, over the range `Bounds().center_wavelength_nm`.
    """
    j, i = (int(part) for part in ghost.split("-"))
    lens = open_lens(project.lens).lens
    return png_bytes(pair_map(indices_of(lens), (j, i), Bounds()))


def ghost_places(project: Project) -> list[dict[str, object]]:
    """Return the first-order place of each ghost that design can move.

    Returns
    -------
    list of dict
        `name`; `per_slope`, its centre along the line to the light, mm per tangent of the light's angle; `radius`,
        mm.
    """
    settled = resolve_project(project)
    structure_of(settled.lens)
    found = placed_ghosts(settled.lens, f_number=settled.order.f_number, sensor_distance=settled.order.sensor_distance)
    return [
        {"name": f"{one.first_reflection}-{one.second_reflection}", "per_slope": one.place, "radius": one.radius}
        for one in found
    ]


def library() -> tuple[dict[str, object], ...]:
    """Return the user's lenses, then the shipped ones: name, title, patent, and words to search."""
    # a shipped lens hides one of the user that has its name
    shipped = {key_of(name) for name in library_names()}
    own = tuple(_entry(one, own=True) for one in own_library().records if key_of(one.name) not in shipped)
    return (*own, *_shipped_lenses())


@lru_cache(maxsize=1)
def _shipped_lenses() -> tuple[dict[str, object], ...]:
    return tuple(_entry(one, own=False) for one in shipped_records())


def _entry(record: LensRecord, *, own: bool) -> dict[str, object]:
    return {
        "name": record.name, "title": record.title, "source": record.source or record.file,
        "f_number": round(record.f_number, 2), "rows": record.surfaces + 1, "words": record.words, "own": own,
    }  # fmt: skip


@lru_cache(maxsize=1)
def looks() -> tuple[dict[str, object], ...]:
    """Return the shipped looks: name, title, notes, and words to search."""
    known = {name: read_look(name) for name in shipped_looks()}
    return tuple(
        {"name": name, "title": look.name, "notes": look.notes, "words": f"{name} {look.name} {look.notes}".lower()}
        for name, look in known.items()
    )
