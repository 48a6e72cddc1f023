"""Open, import, save and export files of the editor."""

from __future__ import annotations

import hashlib
import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from math import atan, degrees
from pathlib import Path

from ... import __version__
from ...errors import FlarewrightError, LensError, OutputError, ProjectError, raised_as
from ...io.files.atomic_write import write_bytes_atomically
from ...io.files.door import expanded, outside
from ...io.files.file_kind import LENS_SUFFIXES, is_ghost_model_file, kind_of
from ...io.files.text_file import read_toml
from ...io.images.exr import write_exr
from ...io.images.half import exr_scale
from ...io.images.plate_picture import PLATE_SUFFIXES
from ...io.lens.lens_writer import format_lens
from ...io.lens.library import lens_path, library_name, near_names
from ...io.project.look_file import look_text, read_look
from ...io.project.project_file import project_from_data, read_project
from ...io.project.project_text import project_text
from ...measure.replay.measured_project import is_measured, render_any, with_sensor
from ...model import Camera, Iris, Lens, Light, Look, Project
from ...optics.lens.paraxial import first_order
from ...render.image.ocio_space import check_file_space, in_file_space
from ...render.scene.looks import look_of
from ...render.scene.photographic_defaults import as_photographed
from ...render.scene.resolve import open_lens
from ...typing import Progress
from ..commands.lens import first_coating, own_lens
from .image_files import pictures
from .measured_project import check_any, project_for_measured

SAMPLE = "takumar-50-f1.4"
SAMPLE_DEG = (-9.0, 5.0)
# defaults of a new project: image position of the light, and stops below wide open for the user's own lenses
PLACE_MM = (10.5, 5.6)
F_NUMBER = 8.0
PICTURES = PLATE_SUFFIXES
SUFFIXES: dict[str, str] = {
    "exr": ".exr", "comp": ".comp.exr", "png": ".png", "lens": ".lens.toml",
    "project": ".toml", "look": ".look.toml", "csv": ".csv",
}  # fmt: skip


def sample_project() -> Project:
    """Return the project of the first start: the picture of the README."""
    base = project_for_lens(SAMPLE)
    return base.replace(lights=(base.lights[0].replace(field_deg=SAMPLE_DEG),))


def project_for_lens(lens: str | Lens) -> Project:
    """Return a project with a lens and a light in the picture's upper right; library lenses get photographic settings.

    The iris has six blades if the lens defines none.
    """
    known = open_lens(lens).lens
    iris = known.iris if known.iris != Iris() else Iris(blades=6)
    efl = first_order(known).efl
    x, y = (round(degrees(atan(mm / efl)), 3) for mm in PLACE_MM)
    plain = Project(
        lens=lens, iris=iris, coating=first_coating(known), f_number=max(known.f_number, F_NUMBER),
        lights=(Light(field_deg=(x, y)),), camera=Camera(size_px=(1920, 1080), desqueeze=known.squeeze is not None),
    )  # fmt: skip
    return as_photographed(plain)[0]


def look_of_project(project: Project, name: str) -> str:
    """Return the look of a project as the text of a look file."""
    look, _ = look_of(project, name.replace("-", " ").replace("_", " ").capitalize())
    return look_text(look)


def _any_project(_project: Project) -> None:
    """Allow every project."""


def open_any(text: str, allowed: Callable[[Project], None] = _any_project) -> tuple[Project, str | None]:
    """Open a project file, a lens file, a measured flare, or a shipped lens by its name.

    Parameters
    ----------
    text : str
    allowed : callable
        Raises an error if the files that a project names may not be read.

    Returns
    -------
    project : Project
    file : str or None
        The project file, for saving.

    Raises
    ------
    FlarewrightError
        When it is none of these.
    """
    path = expanded(text)
    if path.suffix.lower() == ".toml" and path.is_file() and _is_project(read_toml_of(path)):
        project = read_project(path)
        allowed(project)
        check_any(project)
        return with_sensor(project) if is_measured(project) else project, str(path.resolve())
    if is_ghost_model_file(str(path)):
        return project_for_measured(str(path.resolve())), None
    lens_path(text)
    return project_for_lens(library_name(text) or str(path.resolve())), None


def opened(text: str, allowed: Callable[[Project], None] = _any_project) -> tuple[Project, str | None]:
    """Open a path or name from the page: as `open_any`, with messages in the page's words.

    Parameters
    ----------
    text : str
    allowed : callable
        As of `open_any`.

    Returns
    -------
    project : Project
    file : str or None

    Raises
    ------
    FlarewrightError
        When it is neither a project, a lens file nor a shipped lens.
    """
    text = text.strip()
    path = expanded(text)
    try:
        return open_any(text, allowed)
    except LensError as error:
        if path.exists():
            raise LensError(_without_commands(str(error))) from None
    near = () if path.suffix or path.parent != Path() else near_names(text)
    hint = f"did you mean {' or '.join(near)}?" if near else "the panel Library shows every lens"
    raise LensError(
        f"there is no file and no lens {text!r}: {hint}{'' if near else '; a file is found by its whole path'}"
    )


def _without_commands(words: str) -> str:
    """Remove hints that only help in a terminal."""
    return words.replace(" (flarewright lenses lists them)", " of the panel Library")


def read_toml_of(path: Path) -> dict[str, object]:
    """Read TOML; raise a one-sentence error if it is invalid."""
    with raised_as(ProjectError):
        return read_toml(path, "a project or lens file")


def _is_project(data: dict[str, object]) -> bool:
    return "lights" in data or "lens" in data


@dataclass(frozen=True)
class Imported:
    """Content of a dropped file: a project, look, lens or picture (path), and remarks."""

    project: Project | None = None
    look: Look | None = None
    lens: Lens | None = None
    picture: str | None = None
    remarks: tuple[str, ...] = ()


def imported(name: str, data: bytes, folder: Path, allowed: Callable[[Project], None] = _any_project) -> Imported:
    """Import a file dropped on the page.

    Parameters
    ----------
    name : str
        Name of the file; its suffix determines its kind.
    data : bytes
    folder : Path
        Folder for pictures, which are read again later.
    allowed : callable
        As of `open_any`.

    Raises
    ------
    FlarewrightError
        When the editor cannot read the file; the message names the readable kinds.
    """
    suffix = Path(name).suffix.lower()
    plain = Path(name).name or "dropped"
    if suffix not in (*LENS_SUFFIXES, *PICTURES):
        raise LensError(
            f"{plain} cannot be opened here: drop a lens (.toml, .lens, .zmx, .seq, .len, .dat, .csv, .json), a "
            "measured flare (.json), a project or a look (.toml), or a photograph (.exr, .tif, .png, .jpg)"
        )
    # a new file name for new contents, so that undo finds the old picture
    folder = folder / hashlib.sha256(data).hexdigest()[:12]
    folder.mkdir(parents=True, exist_ok=True)
    # signs that stand for the number of a frame in other names
    path = folder / re.sub(r"[#$%]", "_", plain)
    write_bytes_atomically(path, data)
    if suffix in PICTURES:
        return Imported(picture=str(path))
    try:
        if suffix == ".toml":
            table = read_toml_of(path)
            if kind_of(table) == "look":
                return Imported(look=read_look(path))
            if _is_project(table):
                found = project_from_data(table, folder=folder, where=plain)
                allowed(found)
                check_any(found)
                for image in pictures(found):
                    if Path(image.path).parent == folder and not Path(image.path).is_file():
                        raise ProjectError(f"{image.path} does not exist")
                return Imported(project=with_sensor(found) if is_measured(found) else found)
        if is_ghost_model_file(str(path)):
            return Imported(project=project_for_measured(str(path)))
        opened = open_lens(path)
    except FlarewrightError as error:
        # hide the internal folder from the message
        words = _without_commands(str(error)).replace(str(path), plain)
        if str(folder) in words:
            words = f"{plain}: {words.replace(f'{folder}/', '')}; a dropped file comes alone, so use Open for this one"
        raise type(error)(words) from None
    return Imported(lens=opened.lens.replace(name=opened.lens.name or plain), remarks=opened.remarks)


def project_path(text: str) -> Path:
    """Return the path of a project file; `.toml` is added if missing."""
    path = expanded(text.strip())
    if not path.name:
        raise OutputError("the project needs a file name, like shot.toml")
    return (path if path.suffix.lower() == ".toml" else path.with_name(f"{path.name}.toml")).resolve()


def stamp_of(path: str | Path) -> str | None:
    """Return a hash of a file's contents; None if it cannot be read."""
    try:
        with outside(path, "a project file") as file:
            return _stamp(file.read())
    except FlarewrightError:
        return None


def _stamp(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def save_project(
    project: Project, path: Path, *, look: Callable[[], object] | None = None, replace: bool = True
) -> str:
    """Write a project file.

    Parameters
    ----------
    project : Project
    path : Path
    look, replace
        As in `io.files.atomic_write.write_atomically`.

    Returns
    -------
    str
        Stamp of the written contents; other programs may have changed the file since.

    Raises
    ------
    OutputError
        When it cannot be written.
    FileExistsError
        When a file exists there that must not be replaced.
    """
    data = project_text(project, folder=path.parent).encode()
    write_bytes_atomically(path, data, look=look, replace=replace)
    return _stamp(data)


def command_line(file: str) -> str:
    """Return the command that renders a saved project."""
    stem = Path(file).with_suffix("")
    return f"flarewright render --project {shlex.quote(file)} -o {shlex.quote(f'{stem}.exr')}"


def export_picture(project: Project, path: Path, progress: Progress | None = None) -> None:
    """Render a project at its size and quality into an EXR with layers."""
    check_file_space(project)
    rendering = render_any(project, progress=progress)
    layers, space = in_file_space(rendering.layers, project)
    write_exr(
        path, layers, project.camera.size_px, pixel_type=project.output.pixel_type,
        scale=exr_scale(project), metadata=_metadata(project, path),
        pixel_aspect=rendering.project.camera.pixel_aspect, colorspace=space,
        compression=project.output.compression, matte=rendering.matte,
    )  # fmt: skip


def export_comp(project: Project, path: Path, progress: Progress | None = None) -> None:
    """Render a project at its size and quality over its plate, in the values of the plate.

    Raises
    ------
    FlarewrightError
        There is no plate, its lights were not found, or the picture has another size.
    """
    # imports SciPy, which the editor does not need without a plate
    from ...workflow.plates.found_lights import backplate_shot
    from ...workflow.plates.plate_frame import check_comp, write_comp

    if not project.lit_by_plate:
        raise ProjectError("the comp needs the lights of a plate; drop a photograph on the page, and find its lights")
    plate = backplate_shot(project)
    project = project.replace(output=project.output.replace(layers="passes", matte="none"))
    check_comp(project, plate.size_px)
    rendering = render_any(project, progress=progress)
    write_comp(path, plate, 1, rendering.layers, project, _metadata(project, path), {})


def _metadata(project: Project, path: Path) -> dict[str, str]:
    """Return what a picture at a path says of its making."""
    return {"version": __version__, "project": project_text(project, folder=path.parent)}


def lens_text(project: Project) -> str:
    """Return the project's lens as a lens file."""
    return format_lens(own_lens(project))
