"""Load a lens by name or path and settle everything that a render or an analysis needs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..errors import LensError, ProjectError
from ..io.height_image import read_heights
from ..io.lens_file import read_lens
from ..io.library import lens_path
from ..io.media import complete as complete_media
from ..model import Iris, Lens, Project, Surface
from ..model.raw_lens import RawLens
from ..optics.paraxial import FirstOrder
from ..optics.paraxial import first_order as _first_order
from ..optics.repair import repair
from ..optics.semi_diameters import complete


def load_lens(name_or_path: str | Path, *, remarks: list[str] | None = None) -> Lens:
    """Load a shipped lens or a lens file, repaired and complete.

    Parameters
    ----------
    name_or_path : str or Path
        A shipped lens' name (`flarewright lenses`), a TOML lens file, or a `.lens` file.
    remarks : list of str, optional
        Every repair, estimate and assumption is appended to it, a sentence each.

    Returns
    -------
    Lens
        All semi-diameters known.

    Raises
    ------
    LensError
        When there is no such lens, or it is no camera lens; the message says why.
    GlassError
        For a glass that no catalogue knows.
    """
    told: list[str] = [] if remarks is None else remarks
    path = lens_path(str(name_or_path))
    reading = read_lens(path)
    # a `.lens` table needs optics to tell diameters from semi-diameters, so it is repaired here
    lens, found = repair(reading) if isinstance(reading, RawLens) else reading
    told.extend(found)
    return complete_lens(lens, remarks=told)


def complete_lens(lens: Lens, *, remarks: list[str] | None = None) -> Lens:
    """Fill in what a prescription leaves out and check that it makes an image.

    Parameters
    ----------
    lens : Lens
    remarks : list of str, optional
        Estimates are told here.

    Returns
    -------
    Lens

    Raises
    ------
    LensError
        When the lens makes no image by itself.
    """
    known, found = complete_media(_with_heights(lens))
    if remarks is not None:
        remarks.extend(found)
    order = first_order(known)
    full = complete(known)
    surfaces = sum(isinstance(row, Surface) for row in full.rows)
    estimated = [str(k) for k, row in enumerate(full.rows) if isinstance(row, Surface) and row is not known.rows[k]]
    if remarks is not None:
        if estimated:
            which = (
                "all rows" if len(estimated) == surfaces else f"row{'s'[: len(estimated) > 1]} {', '.join(estimated)}"
            )
            remarks.append(f"semi-diameters of {which} estimated from f/{lens.f_number:g} and the field of view")
        stated = lens.stated_focal_length
        if stated is not None and abs(order.efl / stated - 1.0) > 0.02:
            remarks.append(f"the focal length is {order.efl:.2f} mm, the file says {stated:g} mm")
    return full


def _with_heights(lens: Lens) -> Lens:
    """Read the images of figure errors."""
    rows = []
    for row in lens.rows:
        figure = row.figure if isinstance(row, Surface) else None
        if figure is not None and figure.image is not None and figure.heights is None:
            rows.append(row.replace(figure=figure.replace(heights=read_heights(figure.image))))
        else:
            rows.append(row)
    found: Lens = lens if all(a is b for a, b in zip(rows, lens.rows, strict=True)) else lens.replace(rows=tuple(rows))
    return found


def as_lens(lens: Lens | str | Path, *, remarks: list[str] | None = None) -> Lens:
    """Take a lens in whatever form a person has it.

    Parameters
    ----------
    lens : Lens or str or Path
        A prescription, or what `load_lens` takes.
    remarks : list of str, optional
        Repairs and estimates are told here.

    Returns
    -------
    Lens
        Complete.
    """
    return complete_lens(lens, remarks=remarks) if isinstance(lens, Lens) else load_lens(lens, remarks=remarks)


def first_order(
    lens: Lens,
    f_number: float | None = None,
    *,
    sensor_distance: float | None = None,
    focus_distance: float | None = None,
) -> FirstOrder:
    """Compute focal length, pupils, stop and sensor position of a lens.

    Parameters
    ----------
    lens : Lens
    f_number : float, optional
        None: wide open.
    sensor_distance, focus_distance : float, optional
        Override the lens file's, mm.

    Returns
    -------
    FirstOrder

    Raises
    ------
    LensError
        When the lens makes no image by itself.
    ProjectError
        When the f-number is faster than the lens.
    """
    if f_number is not None and f_number < lens.f_number * (1.0 - 1e-6):
        raise ProjectError(
            f"f/{f_number:g} is faster than {lens.name} opens (f/{lens.f_number:g}); "
            f"choose f/{lens.f_number:g} or a larger number"
        )
    return _first_order(lens, f_number, sensor_distance=sensor_distance, focus_distance=focus_distance)


@dataclass(frozen=True)
class Settled:
    """A project with its lens loaded and its opening computed."""

    project: Project
    lens: Lens
    iris: Iris
    order: FirstOrder
    remarks: tuple[str, ...]


def settle(project: Project) -> Settled:
    """Load the lens of a project and compute its opening and focus.

    Parameters
    ----------
    project : Project

    Returns
    -------
    Settled

    Raises
    ------
    FlarewrightError
        As `load_lens` and `first_order`.
    """
    remarks: list[str] = []
    lens = as_lens(project.lens, remarks=remarks)
    camera = project.camera
    order = first_order(
        lens, project.f_number, sensor_distance=camera.sensor_distance, focus_distance=camera.focus_distance
    )
    if order.sensor_distance > 1e5:
        raise LensError(
            f"{lens.name}: the sensor would stand {order.sensor_distance / 1000:.0f} m behind the lens; check the focus"
        )
    iris = project.iris if project.iris is not None else lens.iris
    return Settled(project, lens, iris, order, tuple(remarks))
