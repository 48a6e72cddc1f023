"""Colour spaces of OpenColorIO configurations (the extra `color`) for the pixels of files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np

from ...colorimetry import PRIMARIES
from ...errors import ProjectError
from ...io.images.file_space import FileSpace
from ...model import Layer, Project
from ...model.project.camera import Colorspace
from ...optics.colour.rgb import adapted_to_rgb_matrix, xyz_to_rgb_matrix
from ...typing import Floats
from .aces_view import aces_available

DEFAULT = "ocio://default"
"""The configuration that the library has built in."""

# what the processor works from, by the names of its built-in configurations, and in others
_REC709 = ("lin_rec709_scene", "lin_rec709", "Linear Rec.709 (sRGB)", "Utility - Linear - sRGB", "lin_srgb")
# largest difference of a matrix from that of known primaries: configurations round to some six digits
_SAME = 1e-4
_AnyLayer = TypeVar("_AnyLayer", bound=Layer)


def config_name(given: str | None) -> str:
    """Return the configuration that is used: the given one, else that of the variable OCIO, else the built-in one.

    Parameters
    ----------
    given : str or None
        A file, or a name such as "ocio://default".
    """
    return given or os.environ.get("OCIO") or DEFAULT


def check_file_space(project: Project) -> tuple[str, ...]:
    """Raise an error if the pixels of a project's files cannot be converted to their colour space; return remarks.

    Raises
    ------
    ProjectError
        OpenColorIO is missing, the configuration cannot be read, or it has no such linear space of scenes.
    """
    if project.output.ocio_space is None:
        unused = project.output.ocio_config is not None
        return ("output.ocio_config has no effect without output.ocio_space, which is missing",) if unused else ()
    if project.quality.mode == "reference":
        raise ProjectError(
            "variances of reference quality cannot be converted to another colour space: choose rec709 or acescg, or "
            "another quality"
        )
    if project.output.gamut == "compress":
        raise ProjectError(
            'gamut = "compress" moves colours into the primaries of rec709 or acescg, before they are converted to '
            f"{project.output.ocio_space}: choose one of the two, or keep the gamut"
        )
    _space(project)
    return ()


def has_film_primaries(project: Project) -> bool:
    """Return whether films can be made of a project's files: their header states Rec.709 or ACEScg."""
    return project.output.ocio_space is None or _space(project)[0].known in ("lin_rec709_scene", "lin_ap1_scene")


def config_digest(project: Project) -> str:
    """Return a text that changes with the conversion of a project's files; empty without one."""
    if project.output.ocio_space is None:
        return ""
    config = _config(config_name(project.output.ocio_config))
    return f"{project.output.ocio_space} {config.getCacheID()}"


def in_file_space(layers: Sequence[_AnyLayer], project: Project) -> tuple[list[_AnyLayer], Colorspace | FileSpace]:
    """Return layers in the colour space of a project's files, and that space.

    Parameters
    ----------
    layers : sequence of Layer
        Linear, in `Output.colorspace`.
    project : Project

    Raises
    ------
    ProjectError
        As `check_file_space`.
    """
    if project.output.ocio_space is None:
        return list(layers), project.output.colorspace
    space, processor = _space(project)
    found = []
    for layer in layers:
        pixels = np.array(layer.pixels, dtype=np.float32, order="C")
        processor.applyRGB(pixels)
        found.append(replace(layer, pixels=pixels))
    return found, space


def _space(project: Project) -> tuple[FileSpace, Any]:
    output = project.output
    assert output.ocio_space is not None, "only called with a space"
    return _found(output.ocio_space, config_name(output.ocio_config))


def _config(name: str) -> Any:
    """Read a configuration; recently read ones are cached."""
    return _read(name, os.stat(name).st_mtime_ns if os.path.isfile(name) else 0)


@lru_cache(maxsize=4)
def _read(name: str, changed_ns: int) -> Any:
    del changed_ns
    if not aces_available():
        raise ProjectError(
            "colour spaces beside rec709 and acescg need opencolorio: pip install 'flarewright[color]', or choose one "
            "of these two"
        )
    import PyOpenColorIO

    level = PyOpenColorIO.GetLoggingLevel()
    # warnings about a configuration would mix with ours
    PyOpenColorIO.SetLoggingLevel(PyOpenColorIO.LOGGING_LEVEL_NONE)
    try:
        return PyOpenColorIO.Config.CreateFromFile(name)
    except (PyOpenColorIO.Exception, PyOpenColorIO.ExceptionMissingFile) as error:
        reason = " ".join(str(error).split())[:160].rstrip(".")
        raise ProjectError(
            f"the OpenColorIO configuration {name} cannot be read ({reason}): give another with --ocio, or correct the "
            "variable OCIO"
        ) from None
    finally:
        PyOpenColorIO.SetLoggingLevel(level)


def _found(name: str, config_file: str) -> tuple[FileSpace, Any]:
    """Return a space by its name, role or alias, and the processor from linear Rec.709; raises ProjectError."""
    config = _config(config_file)
    import PyOpenColorIO

    found = config.getColorSpace(name)
    of = f"the colour space {name!r} of {config_file}"
    if found is None:
        problem = f"{config_file} has no colour space, role or alias {name!r}"
    elif found.isData():
        problem = f"{of} holds data and no colours"
    elif found.getReferenceSpaceType() == PyOpenColorIO.REFERENCE_SPACE_DISPLAY:
        problem = f"{of} refers to a display and not to a scene"
    elif not config.isColorSpaceLinear(name, PyOpenColorIO.REFERENCE_SPACE_SCENE):
        problem = f"{of} is not linear, so layers would not add up"
    else:
        processor = _processor(config, found.getName(), config_file)
        stated = config.getName() or os.path.basename(config_file)
        return FileSpace(found.getName(), stated, _known(_matrix(processor))), processor
    near = ", ".join(_near(config, name))
    raise ProjectError(f"{problem}; choose rec709, acescg{f', or a linear one such as {near}' if near else ''}")


def _near(config: Any, name: str) -> list[str]:
    """Return linear spaces of scenes with names like a name, or else the first ones."""
    import PyOpenColorIO

    names: dict[str, str] = {}
    for space in config.getColorSpaces(PyOpenColorIO.SEARCH_REFERENCE_SPACE_SCENE, PyOpenColorIO.COLORSPACE_ALL):
        own = space.getName()
        if not space.isData() and config.isColorSpaceLinear(own, PyOpenColorIO.REFERENCE_SPACE_SCENE):
            names |= {known.lower(): own for known in (own, *space.getAliases())}
    close = [names[one] for one in get_close_matches(name.lower(), names, n=6, cutoff=0.4)]
    return list(dict.fromkeys(close or names.values()))[:4]


def _processor(config: Any, name: str, config_file: str) -> Any:
    """Return the processor from linear Rec.709 to a space of a configuration."""
    import PyOpenColorIO

    try:
        # by the role aces_interchange, or what the library recognizes without it
        return PyOpenColorIO.Config.GetProcessorFromBuiltinColorSpace(_REC709[0], config, name).getDefaultCPUProcessor()
    except PyOpenColorIO.Exception:
        own = next((one for one in _REC709 if config.getColorSpace(one) is not None), None)
        if own is None:
            raise ProjectError(
                f"the OpenColorIO configuration {config_file} does not say how its spaces relate to others: give it "
                "the role aces_interchange, or a space lin_rec709"
            ) from None
        return config.getProcessor(own, name).getDefaultCPUProcessor()


def _matrix(processor: Any) -> Floats:
    """Return the matrix of a linear processor."""
    pixels = np.eye(3, dtype=np.float32).reshape(3, 1, 3).copy()
    processor.applyRGB(pixels)
    return np.asarray(pixels.reshape(3, 3).T, dtype=np.float64)


def _known(matrix: Floats) -> str | None:
    """Return the key of the primaries to which a matrix from linear Rec.709 leads; None if they are not known."""
    to_xyz = np.linalg.inv(xyz_to_rgb_matrix("rec709"))
    for name, xy in PRIMARIES.items():
        if np.abs(adapted_to_rgb_matrix(xy) @ to_xyz - matrix).max() < _SAME:
            return name
    return None
