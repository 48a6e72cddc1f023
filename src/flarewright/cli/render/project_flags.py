"""Conversion of the flags of `flarewright render` to a project."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from ...errors import ProjectError
from ...io.files.door import no_file
from ...io.lens.coating_text import parse_coating_choice
from ...io.lens.plate_text import parse_grating, parse_imperfection, parse_plate
from ...io.project.camera_list import is_camera_name
from ...io.project.project_file import validation_messages
from ...io.project.spectrum_text import parse_spectrum
from ...jobs.frame_list import FramePattern
from ...model import Art, Holdout, Iris, Lens, Light, Project, ProjectCurve, Scatter
from ...model.project.camera import Colorspace
from ...model.project.light import SUN_DEG
from ..common import field_angles, pair
from .art_flags import art_flags
from .options.record import RenderOptions
from .sun_light import sun_field
from .tracks import pixel_place, with_new_lights

# Option that sets each key of a project file; errors on the key name the flag of the option.
_OPTION_OF = {
    "f_number": "fstop",
    "iris.blades": "blades", "iris.rotation_deg": "rotation", "iris.rounding": "rounding",
    "iris.roughness_um": "roughness",
    "imperfection.ghost_offset_mm": "ghost_offset",
    "scatter.model": "scatter", "scatter.roughness_nm": "surface_roughness", "scatter.cleanliness_level": "cleanliness",
    "intensity": "intensity", "diameter_deg": "light_diameter", "distance": "distance",
    "shape.size_deg": "light_size", "shape.corners_deg": "light_polygon",
    "camera.size_px": "size", "camera.sensor_mm": "sensor", "camera.sensor_distance": "sensor_distance",
    "camera.focus_distance": "focus", "camera.cover_glass": "cover_glass",
    "camera.sensor_reflectance": "sensor_reflectance", "camera.sensor_grating": "sensor_grating",
    "camera.squeeze": "squeeze", "camera.desqueeze": "desqueeze",
    "quality.mode": "quality", "quality.wavelengths": "wavelengths", "quality.paths": "paths",
    "quality.orders": "orders", "quality.order4_limit": "order4_limit", "quality.ringing": "ringing",
    "quality.seed": "seed", "quality.reference_error": "error", "quality.reference_error_of": "error_of",
    "quality.reference_samples": "samples", "quality.reference_from": "rays_from",
    "dirt.dust_per_mm2": "dust", "dirt.scratches_per_cm2": "scratches", "dirt.fingerprint": "fingerprint",
    "dirt.image": "dirt_image", "dirt.seed": "seed",
    "starburst.cats_eye": "cats_eye", "starburst.size": "starburst_size", "starburst.spiral_deg": "starburst_spiral",
    "output.layers": "layers", "output.brightest": "brightest", "output.gamut": "gamut",
    "output.compression": "compression", "output.starburst": "no_starburst", "output.matte": "matte",
    "output.matte_ranks": "matte_ranks",
    "output.colorspace": "colorspace", "output.ocio_space": "colorspace", "output.ocio_config": "ocio",
}  # fmt: skip
# the same of options of shots
_SHOT_OPTION_OF = {"timeline.fps": "fps", "timeline.start": "start"}
# sections that options set key by key; `space_flags` has three keys of the output
_SECTIONS = ("camera", "quality", "dirt", "starburst", "output")
_OF_SPACE = ("output.colorspace", "output.ocio_space", "output.ocio_config")

# flags that affect each scatter model; all affect a model that is not listed
_SCATTER_USES: dict[str, tuple[str, ...]] = {"none": (), "chaumond": (), "abg": ("--cleanliness",)}


def build_project(flags: RenderOptions) -> Project:
    """Return the project of the flags, based on that of the project file, of a resumed render or of a look.

    Raises
    ------
    ProjectError
        When a flag is invalid or something is missing; the error lists all findings.
    """
    _check_together(flags)
    base = flags.base
    if base is None and not flags.lens:
        raise ProjectError("no lens is given; name one (flarewright lenses lists them) or give a --project file")
    if base is None and not (flags.light or flags.light_px or flags.sun or flags.tracked):
        raise ProjectError("no light is given; give its place in degrees by --light X,Y, for example --light 10,5")
    fields: dict[str, Any] = {name: getattr(base, name) for name in Project.model_fields} if base else {}
    if flags.lens is not None:
        fields["lens"] = flags.lens
    check_focus(fields["lens"], flags.focus, flags.sensor_distance)
    fields["lights"] = _lights(flags, base.lights if base else ())
    if flags.fstop is not None:
        fields["f_number"] = flags.fstop
    if flags.coating is not None:
        fields["coating"] = parse_coating_choice(flags.coating)
    if flags.zoom is not None:
        fields["zoom"] = flags.zoom
    if flags.filter_plate is not None:
        fields["filter"] = parse_plate(flags.filter_plate, "--filter")
    if flags.imperfection is not None:
        fields["imperfection"] = parse_imperfection(flags.imperfection)
    if flags.ghost_offset is not None:
        # on its own it shifts ghosts only: the lens is as designed
        nothing = {"seed": flags.seed or 0, "decentre_um": 0.0, "tilt_arcmin": 0.0}
        fields["imperfection"] = {**dict(fields.get("imperfection") or nothing), "ghost_offset_mm": flags.ghost_offset}
    if (iris := _iris(flags, fields["lens"], base)) is not None:
        fields["iris"] = iris
    for section in _SECTIONS:
        if given := _given(flags, section):
            fields[section] = {**(dict(getattr(base, section)) if base else {}), **given}
    if spaces := space_flags(flags, base):
        fields["output"] = {**dict(fields.get("output") or {}), **spaces}
    if base is not None:
        fields["curves"] = _kept_curves(flags, base)
    scatter = base.scatter if base else None
    changed = {
        "scatter": scatter_flags(flags.scatter, flags.surface_roughness, flags.cleanliness, scatter),
        "holdout": _holdout(flags, base.holdout if base else None),
        "art": art_flags(flags, base.art if base else Art()),
    }
    fields |= {section: table for section, table in changed.items() if table is not None}
    return project_of(fields)


def space_flags(flags: RenderOptions, base: Project | None) -> dict[str, Any]:
    """Return the colour space of the flags; empty when none sets it.

    The configuration that the variable OCIO names becomes part of the project: it draws the same file later.
    """
    if flags.colorspace in get_args(Colorspace):
        if flags.ocio is not None:
            raise ProjectError(f"--ocio has no effect on --colorspace {flags.colorspace}, which is built in; keep one")
        return {"colorspace": flags.colorspace, "ocio_space": None, "ocio_config": None}
    space = flags.colorspace or (None if base is None else base.output.ocio_space)
    if flags.ocio is not None and space is None:
        raise ProjectError("--ocio is the configuration of a colour space: add --colorspace NAME, or omit it")
    if flags.colorspace is None and flags.ocio is None:
        return {}
    from ...render.image.ocio_space import config_name

    if flags.ocio is not None and not flags.ocio.is_file():
        raise ProjectError(f"--ocio {flags.ocio} {no_file(flags.ocio)}; give an OpenColorIO configuration")
    config = config_name(None if flags.ocio is None else str(flags.ocio.absolute()))
    if Path(config).is_file():
        # the variable OCIO may name one of this folder
        config = str(Path(config).absolute())
    return {"colorspace": "rec709", "ocio_space": space, "ocio_config": config}


def _kept_curves(flags: RenderOptions, base: Project) -> tuple[ProjectCurve, ...]:
    """Return the project's curves without those of values that flags set: flags override a project."""
    given = {"f_number": flags.fstop, "zoom": flags.zoom, "focus_distance": flags.focus, "rotation_deg": flags.rotation}
    gains = [text.partition("=")[0].strip() for text in flags.gain]
    return tuple(
        curve for curve in base.curves if given.get(curve.of) is None and curve.of.removeprefix("gain.") not in gains
    )


def project_of(fields: dict[str, Any]) -> Project:
    """Return the project of fields that flags set; errors name the flags.

    Raises
    ------
    ProjectError
        A setting cannot be used.
    """
    try:
        return Project.model_validate(fields)
    except ValidationError as error:
        # one flag may set more than one field
        findings = list(dict.fromkeys(in_flags(sentence) for sentence in validation_messages(error, fields)))
        if len(findings) == 1:
            raise ProjectError(findings[0]) from None
        message = f"{len(findings)} settings cannot be used, the first: {findings[0]}"
        raise ProjectError(message, tuple(findings)) from None


def _check_together(flags: RenderOptions) -> None:
    """Raise an error for flags of which one makes another ineffective."""
    shapes = {"--blades": flags.blades, "--rounding": flags.rounding, "--roughness": flags.roughness}
    for flag, value in shapes.items():
        if flags.iris_image is not None and value is not None:
            raise ProjectError(f"{flag} shapes blades and --iris-image replaces them; keep one")
        if flags.blades == 0 and value is not None and flag == "--rounding":
            raise ProjectError(f"{flag} shapes blades and --blades 0 is round without any; keep one")
    by_hand = {
        "--rule": flags.rule, "--mute": flags.mute, "--solo": flags.solo, "--gain": flags.gain,
        "--starburst-size": flags.starburst_size, "--starburst-spiral": flags.starburst_spiral,
        "--ghost-offset": flags.ghost_offset,
    }  # fmt: skip
    for flag, change in by_hand.items():
        if flags.physical and change not in (None, [], ()):
            raise ProjectError(f"{flag} is an override and --physical ignores all overrides; keep one")
    of_starburst = {
        "--cats-eye": flags.cats_eye or None, "--starburst-size": flags.starburst_size,
        "--starburst-spiral": flags.starburst_spiral,
    }  # fmt: skip
    for flag, shape in of_starburst.items():
        if flags.no_starburst and shape is not None:
            raise ProjectError(f"{flag} shapes the starburst and --no-starburst omits it; keep one")


def check_focus(lens: str | Lens, focus: float | None, sensor_distance: float | None) -> None:
    """Raise an error for a focus that the sensor's distance makes ineffective: of a lens without focusing groups."""
    if focus is None or sensor_distance is None:
        return
    from ...render.scene.resolve import open_lens

    if not any(position.focus_distance is not None for position in open_lens(lens).lens.positions):
        raise ProjectError("--focus and --sensor-distance both place the sensor; keep one")


def _given(flags: RenderOptions, section: str) -> dict[str, Any]:
    """Return the settings of a section that the flags set, by key."""
    found: dict[str, Any] = {}
    for key, option in _OPTION_OF.items():
        if not key.startswith(f"{section}.") or key in _OF_SPACE:
            continue
        value = getattr(flags, option)
        if value is not None and value is not False:
            found[key.partition(".")[2]] = _READERS[key](value) if key in _READERS else value
    if section == "output" and (flags.half or flags.float32):
        found["pixel_type"] = "half" if flags.half else "float"
    return {key: value for key, value in found.items() if value is not None}


def _sensor_mm(text: str) -> tuple[float, float] | None:
    """Return the numbers of `--sensor`; `framing` resolves the name of a camera, with the size of the picture."""
    return None if is_camera_name(text) else pair(text, "--sensor", "36x24 (mm)", "x")


def _size_px(text: str) -> tuple[int, int]:
    """Return the numbers of `--size`; whether a picture can have them is for the project to say."""
    width, height = pair(text, "--size", "1280x720", "x")
    if width != int(width) or height != int(height):
        raise ProjectError(f"--size {text!r} is not two whole numbers of pixels; write --size 1280x720")
    return int(width), int(height)


def _dirt_image(path: Path) -> str:
    if not path.is_file():
        raise ProjectError(f"--dirt-image {path} {no_file(path)}; give a grey PNG or EXR image")
    return str(path)


# what the texts of options mean; other options hold the setting itself
_READERS: dict[str, Callable[[Any], Any]] = {
    "camera.size_px": _size_px,
    "camera.sensor_mm": _sensor_mm,
    "camera.cover_glass": lambda text: parse_plate(text, "--cover-glass"),
    "camera.sensor_grating": parse_grating,
    "dirt.image": _dirt_image,
    "output.starburst": lambda omitted: not omitted,
}


def _lights(flags: RenderOptions, base: tuple[Light, ...]) -> list[dict[str, Any]]:
    """Return the lights: those of the flags, else those of the project, with intensities and spectra of the flags."""
    lights = with_new_lights(flags.tracked, known_lights(flags, base))
    spectra = [parse_spectrum(text) for text in flags.spectrum]
    for name, values in (
        ("intensity", flags.intensity),
        ("spectrum", spectra),
        ("distance", [None if distance == float("inf") else distance for distance in flags.distance]),
    ):
        changes = [{name: value} for value in values]
        _share_out(f"--{name}", changes, lights)
        for light in lights if changes else ():
            # a flag overrides the curves of its value
            overridden = {"intensity": ("intensity",), "spectrum": ("rgb", "temperature_k")}.get(name, ())
            light["curves"] = tuple(curve for curve in light.get("curves", ()) if curve.of not in overridden)
    _extents(flags, lights)
    return lights


def _share_out(flag: str, changes: list[dict[str, Any]], lights: list[dict[str, Any]], *, others: bool = False) -> None:
    """Apply the values of a flag to lights: one for all, or one for each."""
    if changes and len(changes) not in (1, len(lights)):
        what = f"{'other ' if others else ''}light{'' if len(lights) == 1 else 's'}"
        raise ProjectError(
            f"{flag} is given {len(changes)} times for {len(lights)} {what}; give it once for all "
            f"{'other ' if others else ''}lights, or once per light in the same order"
        )
    for k, light in enumerate(lights):
        if changes:
            light.update(changes[k % len(changes)])


def _extents(flags: RenderOptions, lights: list[dict[str, Any]]) -> None:
    """Set the shapes of lights: discs, rectangles or polygons; a sun is a disc already."""
    shapes: dict[str, list[dict[str, Any]]] = {
        "--light-size": [{"kind": "rectangle", "size_deg": _size(text)} for text in flags.light_size],
        "--light-polygon": [{"kind": "polygon", "corners_deg": _corners(text)} for text in flags.light_polygon],
    }
    given = [flag for flag, values in {"--light-diameter": flags.light_diameter, **shapes}.items() if values]
    if len(given) > 1:
        raise ProjectError(
            f"{' and '.join(given)} each set the shape of lights; give one of them, or write a project file for "
            "lights of several kinds"
        )
    _share_out("--light-diameter", [{"diameter_deg": angle, "shape": None} for angle in flags.light_diameter], lights)
    given_here = flags.light or flags.light_px or flags.sun
    suns = [light for light in lights if given_here and light.get("name") == "sun"]
    rest = [light for light in lights if light not in suns]
    for flag, values in shapes.items():
        if values and not rest:
            raise ProjectError(f"{flag}: --light sun@X,Y is a disc already; write --light X,Y for this shape")
        _share_out(flag, [{"shape": shape, "diameter_deg": 0.0} for shape in values], rest, others=bool(suns))


def flag_lights(flags: RenderOptions) -> list[dict[str, Any]]:
    """Return the lights of `--light`, `--light-px` and `--sun`, in this order.

    Those of `--light-px` are on the axis: their place follows from the project (`tracks.placed`).
    """
    lights = [parsed_light(text) for text in flags.light]
    for text in flags.light_px:
        lights.append({"field_deg": (0.0, 0.0), **_word_of(text, "--light-px", "640,360")})
        pixel_place(text)
    if flags.sun is not None:
        lights.append({"field_deg": sun_field(flags).field_deg, **_SUN})
    return lights


def known_lights(flags: RenderOptions, base: tuple[Light, ...]) -> list[dict[str, Any]]:
    """Return the lights of the flags, else those of the project."""
    return flag_lights(flags) or [dict(light) for light in base]


_SUN: dict[str, Any] = {"name": "sun", "diameter_deg": SUN_DEG}


def parsed_light(text: str) -> dict[str, Any]:
    """Return the fields of a light from `--light`, X,Y or sun@X,Y."""
    found = _word_of(text, "--light", "10,5")
    return {"field_deg": field_angles(text.rpartition("@")[2]), **found}


def _word_of(text: str, flag: str, example: str) -> dict[str, Any]:
    """Return the fields of a light that the word before its place sets."""
    word, at, _ = text.rpartition("@")
    if at and word.strip().lower() != "sun":
        raise ProjectError(
            f"{flag} {text!r}: there is no {word.strip()!r}; write {flag} {example} or {flag} sun@{example}"
        )
    if text.strip().lower() == "sun":
        unit = "degrees right and up" if flag == "--light" else "pixels"
        raise ProjectError(f"{flag} sun has no place; write {flag} sun@{example} ({unit})")
    return dict(_SUN) if at else {}


def _size(text: str) -> tuple[float, float]:
    return pair(text, "--light-size", "4x3 (degrees wide and high)", "x")


def _corners(text: str) -> tuple[tuple[float, float], ...]:
    """Return the corners of `--light-polygon "X,Y X,Y X,Y"`."""
    corners = tuple(pair(corner, "--light-polygon", '"0,0 3,0 3,1" (degrees right and up)') for corner in text.split())
    if len(corners) < 3:
        raise ProjectError(
            f"--light-polygon {text!r} has {len(corners)} corners; give three or more, --light-polygon "
            '"0,0 3,0 3,1" (degrees right and up)'
        )
    return corners


def _iris(flags: RenderOptions, lens: Any, base: Project | None) -> dict[str, Any] | None:
    """Return the iris with the flags' changes, or None when no flag changes it."""
    mask = None if flags.iris_image is None else str(flags.iris_image)
    if mask is not None and not Path(mask).is_file():
        raise ProjectError(f"--iris-image {mask} {no_file(mask)}; give a grey PNG or EXR image")
    given = _given(flags, "iris")
    if mask is not None:
        given["mask"] = mask
    if flags.roughness and flags.seed is not None:
        given["roughness_seed"] = flags.seed
    if not given:
        return None
    if base is not None and base.iris is not None and flags.lens is None:
        iris = base.iris
    elif isinstance(lens, str):
        # Rotating the blades must keep the lens' number of them.
        from ...render.scene.resolve import open_lens

        iris = open_lens(lens).lens.iris
    else:
        iris = lens.iris if lens is not None else Iris()
    return {**dict(iris), **given}


def _holdout(flags: RenderOptions, base: Holdout | None) -> dict[str, Any] | None:
    """Return the occluder with the flags' file, or None when no flag names one."""
    given = {"image": flags.holdout, "depth": flags.depth}
    if flags.holdout is not None and flags.depth is not None:
        raise ProjectError("--holdout and --depth both hide lights; give one of them")
    for flag, path in (("--holdout", flags.holdout), ("--depth", flags.depth)):
        # the frames of a sequence are checked when they are chosen
        if path is not None and not path.is_file() and not FramePattern(str(path)).numbered:
            what = "a grey PNG or EXR image" if flag == "--holdout" else "an EXR depth plate"
            raise ProjectError(f"{flag} {path} {no_file(path)}; give {what} in the picture's frame")
    if flags.holdout is None and flags.depth is None:
        return None
    kept = dict(base) if base is not None and (base.image is None) == (flags.holdout is None) else {}
    return {**kept, **{key: None if path is None else str(path) for key, path in given.items()}}


def scatter_flags(
    model: str | None, roughness: float | None, cleanliness: float | None, base: Scatter | None = None
) -> dict[str, Any] | None:
    """Return the scatter settings with the flags' changes, or None when no flag changes them.

    Parameters
    ----------
    model : str or None
        `--scatter`.
    roughness, cleanliness : float or None
        `--surface-roughness` and `--cleanliness`; each of them enables scatter.
    base : Scatter or None
        Settings of the project.
    """
    changes = {"model": model, "roughness_nm": roughness, "cleanliness_level": cleanliness}
    given = {key: value for key, value in changes.items() if value is not None}
    if not given:
        return None
    known = dict(base) if base is not None else {}
    if known.get("model") == "none":
        del known["model"]
    of_project = known.get("model", "")
    used = _SCATTER_USES.get(model or of_project, ("--surface-roughness", "--cleanliness"))
    for flag, value in (("--surface-roughness", roughness), ("--cleanliness", cleanliness)):
        if value is not None and flag not in used:
            if model is None:
                raise ProjectError(
                    f"{flag} has no effect on the scatter of the project, {of_project}; add --scatter harvey-shack, "
                    "or leave it out"
                )
            raise ProjectError(f"{flag} has no effect on --scatter {model}; keep one")
    return {"model": "harvey-shack", **known, **given}


def in_flags(sentence: str) -> str:
    """Replace keys of a project file in a message by flags."""
    for key, option in (_OPTION_OF | _SHOT_OPTION_OF).items():
        found = re.match(rf"(?:lights\[\d+\]\.)?{re.escape(key)}(?:\[\d\])?(?=[ :])", sentence)
        if found:
            return f"--{option.replace('_', '-')}{sentence[found.end() :]}"
    return sentence
