"""A frame of a shot over a plate: its lights from the plate, and its comp."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from ...errors import ProjectError
from ...io.images.exr import write_exr
from ...measure.replay.measured_project import is_measured
from ...model import Art, Dirt, Layer, Light, Output, Project, Quality, Starburst
from ...plates.comp import composed, source_mask
from ...plates.field_map import FieldMap, field_map
from ...plates.lights import lights_at, plate_factor
from ...plates.measured_plate import converted, measured_pixels
from ...render.image.ocio_space import in_file_space
from ...render.scene.pixel_place import DirectImages, direct_images
from ...render.scene.resolve import resolve_project
from .plate_files import plate_matte, plate_picture
from .plate_sources import PlateShot

# passes that a comp adds; the beauty is their sum
_BEAUTY = "beauty"
# relative difference of the shapes of plate and picture
_SHAPE_TOLERANCE = 0.01


def with_plate_lights(project: Project, plate: PlateShot, frame: float) -> tuple[Project, float]:
    """Return a project with the lights of a plate.

    Parameters
    ----------
    project : Project
        At the moment of the frame. Its own lights stay; dark ones are removed.
    plate : PlateShot
    frame : float
        Number, or a place between two frames.

    Returns
    -------
    project : Project
    lost : float
        Part of the plate's light at places where the lens images nothing.

    Raises
    ------
    ProjectError
        The project is a measured flare, whose lens is unknown.
    """
    directions, factor = plate_optics(project)
    lights, lost = lights_at(plate.lights, frame, directions, factor, project.camera.size_px)
    own = tuple(light for light in project.lights if light.intensity > 0.0)
    if own:
        lights = tuple(light for light in lights if light.intensity > 0.0)
    found: Project = project.replace(lights=own + lights)
    return found, lost


def with_radiances(project: Project) -> Project:
    """Return a project whose layers have the values of a picture that shows the radiance of the scene.

    Parameters
    ----------
    project : Project
        At one moment. The intensities of its lights are irradiances.

    Returns
    -------
    Project
        With intensities times 4 N^2 / (pi T) (`plates.lights.plate_factor`): the direct image of a light of irradiance
        E and solid angle omega has the value E / omega.

    Raises
    ------
    ProjectError
        The project is a measured flare, whose lens is unknown.
    """
    if is_measured(project):
        raise ProjectError(
            f"{project.lens} is a measured flare, whose lens is unknown, so radiances are too; give a lens, or omit "
            "--radiance"
        )
    factor = plate_optics(project)[1]
    lights = tuple(light.replace(intensity=light.intensity * factor) for light in project.lights)
    return project.replace(lights=lights)


def plate_optics(project: Project) -> tuple[FieldMap, float]:
    """Return the directions of the picture's places, and the plate's factor; both once for the same lens.

    Parameters
    ----------
    project : Project
        Its lights, dirt and art do not matter.

    Returns
    -------
    directions : FieldMap
    factor : float
        `plates.lights.plate_factor`.

    Raises
    ------
    ProjectError
        The project is a measured flare, whose lens is unknown.
    """
    return _optics_of(bare_text(project))[:2]


def plate_images(project: Project) -> DirectImages:
    """Return the direct images of the project's lens, which trace a light to its place; errors as `plate_optics`."""
    return images_of(bare_text(project))


def images_of(lens: str) -> DirectImages:
    """Return the direct images of a lens that `bare_text` describes."""
    return _optics_of(lens)[2]


def same_optics(one: Project, other: Project) -> bool:
    """Return whether the lenses of two projects image a plate alike, with the same brightness."""
    return bare_text(one) == bare_text(other)


def bare_text(project: Project) -> str:
    """Return what bends and dims the direct image, as a key of its traced places; errors as `plate_optics`."""
    if is_measured(project):
        raise ProjectError(
            f"{project.lens} is a measured flare, whose lens is unknown, so places in a plate have no angles; give a "
            "lens"
        )
    bare = project.replace(
        lights=(Light(field_deg=(0.0, 0.0)),), holdout=None, art=Art(), dirt=Dirt(), starburst=Starburst(),
        output=Output(), design=None, curves=(), plate=None,
        quality=Quality(mode="final", wavelengths=project.quality.wavelengths),
    )  # fmt: skip
    return str(bare.model_dump_json())


@lru_cache(maxsize=64)
def _optics_of(text: str) -> tuple[FieldMap, float, DirectImages]:
    settled = resolve_project(Project.model_validate_json(text))
    directions = field_map(settled)
    images = direct_images(settled, Light(field_deg=(0.0, 0.0)))
    return directions, plate_factor(settled, directions), images


def alike_lights(projects: Sequence[Project]) -> list[Project]:
    """Return projects with the lights that all of them have, by name, so that their motion can be compared.

    Where they share none, as before a lamp is switched on, all have those of the first: nothing moves.
    """
    names = set.intersection(*({light.name for light in project.lights} for project in projects))
    found = []
    for project in projects:
        lights = tuple(light for light in project.lights if light.name in names)
        found.append(project.replace(lights=lights or projects[0].lights))
    return found


def check_plate(project: Project, size_px: tuple[int, int]) -> None:
    """Raise ProjectError if a project's picture has another shape than a plate of a size."""
    (width, height), (wide, high) = project.camera.size_px, size_px
    # whole pixels on both sides
    if abs(wide * height / (width * high) - 1.0) > _SHAPE_TOLERANCE + 1.0 / min(width, height):
        raise ProjectError(
            f"the plate is {wide}x{high} and the picture {width}x{height}, of another shape; omit --size, or give one "
            "of the plate's shape"
        )


def check_comp(project: Project, size_px: tuple[int, int]) -> None:
    """Raise ProjectError if a project's passes cannot be laid over a plate of a size."""
    if project.camera.size_px != size_px:
        raise ProjectError(
            f"the comp needs the size of the plate, {size_px[0]}x{size_px[1]}, not "
            f"{project.camera.size_px[0]}x{project.camera.size_px[1]}; give --size "
            f"{size_px[0]}x{size_px[1]}, or omit --over"
        )
    if project.output.layers == "beauty":
        raise ProjectError("the comp needs the passes, for the plate shows the lights already; omit --layers beauty")


def comp_attributes(plate: PlateShot, frame: int) -> dict[str, Any]:
    """Return the attributes of a frame's plate that its flare and its comp carry on, such as timeCode."""
    return dict(plate_picture(plate.settings, frame).header or {})


def write_comp(
    path: Any, plate: PlateShot, frame: int, layers: Sequence[Layer], project: Project, metadata: dict[str, str],
    attributes: dict[str, Any],
) -> None:  # fmt: skip
    """Write the plate with its flare, in the values of the plate.

    Parameters
    ----------
    path : path
    plate : PlateShot
    frame : int
    layers : sequence of Layer
        All layers of the frame's rendering.
    project : Project
    metadata, attributes
        As of `write_exr`.

    Raises
    ------
    FlarewrightError
        The plate cannot be read, or the file cannot be written.
    """
    picture = plate_picture(plate.settings, frame)
    matte = plate_matte(plate.settings, frame, plate.size_px)
    mask = source_mask(measured_pixels(picture, plate.settings.highlights), plate.threshold, matte)
    passes = [layer for layer in layers if layer.name != _BEAUTY and not layer.name.startswith("ghost.")]
    passes = [layer for layer in passes if not layer.name.endswith(".variance")]
    settings = plate.settings
    too_dark = picture.white is not None or settings.gain > 1.0 or settings.source is not None
    whole = composed(converted(picture, project.output.colorspace), passes, mask, too_dark=too_dark)
    shown, space = in_file_space([whole], project)
    # a film of the comp has the curve of its plate
    facts = {"threshold": plate.threshold, "gain": settings.gain, "transfer": picture.transfer}
    write_exr(
        path,
        shown,
        plate.size_px,
        pixel_type=project.output.pixel_type,
        scale=1.0,
        metadata={**metadata, "plate": json.dumps(facts)},
        # the comp has the pixels of the plate; few files state those of an anamorphic lens
        pixel_aspect=project.camera.pixel_aspect if plate.pixel_aspect == 1.0 else plate.pixel_aspect,
        colorspace=space,
        compression=project.output.compression,
        attributes={**attributes, **(picture.header or {})},
    )
