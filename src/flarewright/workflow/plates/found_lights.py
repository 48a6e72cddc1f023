"""The lights of a single plate as lights of a project, and what keeps them on the plate when the lens changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ...errors import FlarewrightError, ProjectError
from ...model import Backplate, Light, LightCurve, LightKey, Project
from ...model.project.backplate import found_in_plate
from ...model.project.light import LEAST_LIGHT_DEG, Polygon, Rectangle
from ...plates.detection import Sources
from ...plates.lights import lights_at, plate_tracks
from ...plates.marked import light_rows
from ...plates.settings import PlateSettings, parse_source
from ...plates.tracking import follow
from ...render.scene.pixel_place import field_angles_at, image_px
from ...sentences import INVALID, count, validation_sentences
from ...typing import Progress
from .plate_files import FRAME, check_single, plate_picture
from .plate_frame import bare_text, check_plate, images_of, plate_images, plate_optics, same_optics
from .plate_sources import PlateShot, plate_shot

# largest disc and rectangle after a change of the lens, degrees
_WIDEST_DISC_DEG, _WIDEST_DEG = 60.0, 110.0


@dataclass(frozen=True)
class FoundLights:
    """The sources that a search has found in a plate.

    Attributes
    ----------
    plate : Backplate
        As searched; `lights_above` is the threshold.
    shot : PlateShot
    """

    plate: Backplate
    shot: PlateShot

    @property
    def rows(self) -> list[dict[str, float | int | str]]:
        """The sources in pixels of the plate, the brightest first (`plates.marked.light_rows`)."""
        return light_rows(self.shot.lights, FRAME)


def plate_settings_of(plate: Backplate) -> PlateSettings:
    """Return the settings with which `shot` and `sources` search a plate.

    Raises
    ------
    ProjectError
        They contradict each other, or the file's name stands for a sequence.
    """
    check_single(plate)
    return PlateSettings(plate.image, **search_values(plate))


def search_values(plate: Backplate) -> dict[str, Any]:
    """Return how a plate is read and searched, as fields of `PlateSettings`."""
    search = plate.search
    return {
        "layer": plate.layer, "transfer": plate.transfer, "threshold": search.threshold, "stops": search.stops,
        "least_px": search.least_px, "most_lights": search.most_lights, "point_px": search.point_px,
        "gain": search.gain, "highlights": search.highlights, "white": search.white,
        "source": None if search.source is None else parse_source(search.source),
    }  # fmt: skip


def search_plate(plate: Backplate, progress: Progress | None = None) -> FoundLights:
    """Find the lights of a plate.

    Parameters
    ----------
    plate : Backplate
    progress : callable, optional
        Called with the finished part of the work and what is done; an exception that it raises ends the search.

    Raises
    ------
    FlarewrightError
        The plate cannot be read, or has no light above the threshold.
    """
    report: Progress = progress or (lambda *_: None)
    settings = plate_settings_of(plate)
    report(0.0, "reading the plate")
    plate_picture(settings, FRAME)
    report(0.4, "finding lights")
    shot = plate_shot(settings, (FRAME,))
    report(1.0, "finding lights")
    return FoundLights(plate.replace(lights_above=shot.threshold), shot)


def with_found_lights(project: Project, found: FoundLights) -> tuple[Project, tuple[str, ...]]:
    """Return a project whose lights are those of a plate, in the plate's unit.

    Parameters
    ----------
    project : Project
        Its picture gets the size of the plate, on the same width of the sensor. If its lights are those of a plate
        already, found ones are replaced and others stay; else all are replaced, for theirs is another unit.
    found : FoundLights

    Returns
    -------
    project : Project
    remarks : tuple of str

    Raises
    ------
    FlarewrightError
        The project is a measured flare, or its lens images too little of the picture.
    """
    framed = _framed(project, found.shot.size_px)
    directions, factor = plate_optics(framed)
    try:
        lights, lost = lights_at(found.shot.lights, FRAME, directions, factor, framed.camera.size_px)
    except INVALID as error:
        raise ProjectError("; ".join(validation_sentences(error))) from None
    if not any(light.intensity > 0.0 for light in lights):
        raise ProjectError("the lens images none of the found lights; choose a longer lens, or a smaller sensor")
    own = tuple(light for light in project.lights if project.lit_by_plate and not found_in_plate(light))
    remarks = [f"{count(len(lights), 'light was', 'lights were')} found", *found.shot.remarks]
    if found.shot.clipped and not found.plate.search.brightened:
        remarks.append("the plate clips them, so they are brighter than it shows: --plate-gain or --highlights says so")
    if lost > 0.0:
        remarks.append(f"{lost:.2%} of the plate's light lies where the lens images nothing, and is left out")
    if framed.camera != project.camera:
        remarks.append(f"the picture has the size of the plate now, {'x'.join(map(str, framed.camera.size_px))}")
    # the brightest first, as a person looks at them
    ordered = sorted(lights, key=lambda light: -light.intensity)
    changed: Project = framed.replace(lights=(*ordered, *own), plate=found.plate)
    return changed, tuple(remarks)


def _framed(project: Project, size_px: tuple[int, int]) -> Project:
    """Return the project with a picture of the plate's size, whose pixels keep their shape on the same width."""
    camera = project.camera
    if camera.size_px == size_px:
        return project
    if camera.sensor_mm is not None:
        across, down = camera.sensor_mm
        high = down * (size_px[1] / size_px[0]) / (camera.size_px[1] / camera.size_px[0])
        camera = camera.replace(sensor_mm=(across, high))
    return project.replace(camera=camera.replace(size_px=size_px))


def without_found_lights(project: Project) -> Project:
    """Return a project without the lights that were found in its plate, for another search of a plate.

    Dark if it has no others.
    """
    if not project.lit_by_plate:
        return project
    own = tuple(light for light in project.lights if not found_in_plate(light))
    return project.replace(lights=own or (Light(field_deg=(0.0, 0.0), intensity=0.0),))


def backplate_shot(project: Project) -> PlateShot:
    """Return the plate of a project for a comp; its lights are those of the project, so none is searched.

    Raises
    ------
    FlarewrightError
        The project has no plate, or lights in another unit, or the plate cannot be read.
    """
    plate = project.plate
    if plate is None:
        raise ProjectError("a comp is laid over a plate, and there is none; give a plate, or omit --over")
    if plate.lights_above is None:
        raise ProjectError(
            "the lights of the project are not those of its plate, so the flare has another unit; find the lights in "
            "the editor, or give the plate on the command line"
        )
    settings = plate_settings_of(plate)
    picture = plate_picture(settings, FRAME)
    none = Sources.from_table(np.zeros((0, 10)))
    tracks = follow((FRAME,), [none], picture.size_px[0])
    return PlateShot(
        settings, plate.lights_above, picture.size_px, picture.pixel_aspect, picture.fps,
        plate_tracks(tracks, picture.size_px), (0,), picture.remarks,
    )  # fmt: skip


def traced_places(project: Project) -> list[tuple[float, float] | None]:
    """Return where the lens images each light, as fractions of the picture from its upper left corner.

    None for a light that the lens does not image.
    """
    key = bare_text(project)
    width, height = project.camera.size_px
    places = [_traced(key, light.field_deg) for light in project.lights]
    return [None if place is None else (place[0] / width, place[1] / height) for place in places]


@lru_cache(maxsize=4096)
def _traced(lens: str, field_deg: tuple[float, float]) -> tuple[float, float] | None:
    """Return where a lens (`plate_frame.bare_text`) images a light, pixels."""
    return image_px(images_of(lens), field_deg)


def kept_on_plate(before: Project, after: Project) -> Project:
    """Return a changed project whose lights lie where they lay in the plate, with the same light in its unit.

    Another f-number, lens, zoom or sensor changes both the angle of a pixel and the irradiance that its value stands
    for. Without this, stopping down would dim the flare, but not the plate.

    Parameters
    ----------
    before, after : Project
        Before and after a change. Projects without a plate's lights, whose lens is the same, or makes no image, are
        returned as they are.

    Raises
    ------
    ProjectError
        The picture has no longer the shape of the plate.

    Notes
    -----
    A light of irradiance E at a place with the solid angle omega of a part of the picture gets E' = E (omega' f') /
    (omega f), with the factors f of `plates.lights.plate_factor`.
    """
    lit = before.lit_by_plate and after.lit_by_plate
    if not lit or len(before.lights) != len(after.lights) or same_optics(before, after):
        return after
    check_plate(after, before.camera.size_px)
    try:
        moved = _Moved(before, after)
    except FlarewrightError:
        # a lens that makes no image, until it is repaired
        return after
    lights = tuple(moved.light(old, new) for old, new in zip(before.lights, after.lights, strict=True))
    return after.replace(lights=lights)


class _Moved:
    """Places and brightnesses of the lights of a plate, from one lens to another."""

    def __init__(self, before: Project, after: Project) -> None:
        self.before, self.after = plate_images(before), plate_images(after)
        self.optics = plate_optics(before), plate_optics(after)
        self.sizes = np.array(before.camera.size_px, float), np.array(after.camera.size_px, float)

    def light(self, old: Light, new: Light) -> Light:
        """Return a light of the changed project, at its place in the plate."""
        field, ratio = self.angles(old.field_deg)
        scale = ratio[0] ** 0.5
        changes: dict[str, Any] = {
            "field_deg": field,
            "intensity": old.intensity * ratio[1],
            "diameter_deg": _angle(old.diameter_deg * scale, _WIDEST_DISC_DEG),
            "shape": _scaled(old.shape, scale),
            "keyframes": tuple(LightKey(at_s=k.at_s, field_deg=self.angles(k.field_deg)[0]) for k in old.keyframes),
            "curves": tuple(_brighter(curve, ratio[1]) for curve in old.curves),
        }
        return new.replace(**changes)

    def angles(self, field_deg: tuple[float, float]) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return new field angles, and the ratios of the solid angle and of the irradiance."""
        place = image_px(self.before, field_deg)
        (directions, factor), (new_directions, new_factor) = self.optics
        if place is None:
            # beside what the lens images: its angle stays, and what the axis says of the brightness
            return field_deg, (1.0, new_factor / factor)
        at = np.array([place])
        new_at = at * self.sizes[1] / self.sizes[0]
        omega = float(directions.solid_angles(at)[0] * self.sizes[0].prod())
        new_omega = float(new_directions.solid_angles(new_at)[0] * self.sizes[1].prod())
        ratio = new_omega / omega if np.isfinite(new_omega) and np.isfinite(omega) and omega > 0.0 else 1.0
        try:
            x, y = field_angles_at(self.after, (float(new_at[0, 0]), float(new_at[0, 1])))
        except ProjectError:
            x, y = field_deg
        return (x, y), (ratio, ratio * new_factor / factor)


def _angle(angle_deg: float, widest_deg: float) -> float:
    return 0.0 if angle_deg < LEAST_LIGHT_DEG else min(angle_deg, widest_deg)


def _brighter(curve: LightCurve, ratio: float) -> LightCurve:
    """Return a curve of a light whose irradiance is multiplied by a ratio."""
    if curve.of != "intensity":
        return curve
    values = np.array(curve.values, dtype=np.float64) * ratio
    return curve.replace(values=tuple(values.tolist()))


def _scaled(shape: Rectangle | Polygon | None, scale: float) -> Rectangle | Polygon | None:
    """Return the shape of an area light, larger or smaller."""
    found: Rectangle | Polygon | None = None
    if isinstance(shape, Rectangle):
        width, height = (min(max(side * scale, LEAST_LIGHT_DEG), _WIDEST_DEG) for side in shape.size_deg)
        found = shape.replace(size_deg=(width, height))
    elif isinstance(shape, Polygon):
        found = shape.replace(corners_deg=tuple((x * scale, y * scale) for x, y in shape.corners_deg))
    return found
