"""Opening, importing and exporting: what goes from the editor to files and back."""

from __future__ import annotations

import csv
import hashlib
import io
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from math import atan, degrees
from pathlib import Path
from typing import Literal

from .. import __version__
from ..errors import FlarewrightError, LensError, OutputError, ProjectError
from ..io.atomic import write_atomically
from ..io.exr import write_exr
from ..io.file_kind import kind_of
from ..io.ghost_model_file import names_ghost_model
from ..io.half import exr_scale
from ..io.lens_writer import format_lens
from ..io.library import lens_path, near_names, shipped
from ..io.look_file import look_text, read_look
from ..io.project_file import project_from_data, project_text, read_project
from ..io.project_text import LENS_SUFFIXES
from ..io.text_file import read_toml
from ..measure.rendering import render_any
from ..model import Camera, Iris, Lens, Light, Look, Project
from ..render.looks import look_of
from ..render.photographed import as_photographed
from ..render.prepare import complete_lens, first_order, load_lens
from .edit_lens import first_coating, own_lens
from .measured import check_any, project_for_measured
from .pictures import pictures
from .seen import Seen

SAMPLE = "takumar-50-f1.4"
SAMPLE_DEG = (-9.0, 5.0)
# of a new project: where the light is imaged, and how far a lens of a person's own is stopped down
PLACE_MM = (10.5, 5.6)
F_NUMBER = 8.0
PICTURES = (".exr", ".png", ".jpg", ".jpeg")
Kind = Literal["exr", "png", "lens", "project", "look", "csv"]
SUFFIXES: dict[str, str] = {
    "exr": ".exr", "png": ".png", "lens": ".lens.toml", "project": ".toml", "look": ".look.toml", "csv": ".csv",
}  # fmt: skip


def sample_project() -> Project:
    """Return the project that the first run shows: the picture of the README."""
    base = project_for_lens(SAMPLE)
    shown: Project = base.replace(lights=(base.lights[0].replace(field_deg=SAMPLE_DEG),))
    return shown


def project_for_lens(lens: str | Lens) -> Project:
    """Return a project with a lens and a light in the picture's upper right, a lens of the library as photographed.

    Six blades where a lens says nothing of its iris.
    """
    known = load_lens(lens) if isinstance(lens, str) else complete_lens(lens)
    iris = known.iris if known.iris != Iris() else Iris(blades=6)
    efl = first_order(known).efl
    x, y = (round(degrees(atan(mm / efl)), 3) for mm in PLACE_MM)
    plain = Project(
        lens=lens, iris=iris, coating=first_coating(known), f_number=max(known.f_number, F_NUMBER),
        lights=(Light(field_deg=(x, y)),), camera=Camera(size_px=(1920, 1080), desqueeze=known.squeeze is not None),
    )  # fmt: skip
    return as_photographed(plain)[0]


def look_of_project(project: Project, name: str) -> str:
    """Return the look of a project as a look's file."""
    look, _ = look_of(project, name.replace("-", " ").replace("_", " ").capitalize())
    return look_text(look)


def open_any(text: str) -> tuple[Project, str | None]:
    """Open a project file, a lens file, a measured flare, or a shipped lens by its name.

    Parameters
    ----------
    text : str

    Returns
    -------
    project : Project
    file : str or None
        The project file, to be saved to again.

    Raises
    ------
    FlarewrightError
        When it is neither.
    """
    path = Path(text).expanduser()
    if path.suffix.lower() == ".toml" and path.is_file() and _is_project(read_toml_of(path)):
        project = read_project(path)
        check_any(project)
        return project, str(path.resolve())
    if names_ghost_model(str(path)):
        return project_for_measured(str(path.resolve())), None
    found = lens_path(text)
    name = found.stem if found.stem in shipped() and not path.exists() else str(path.resolve())
    return project_for_lens(name), None


def opened(text: str) -> tuple[Project, str | None]:
    """Open what a person asks the page for: as `open_any`, but what does not exist is told in the page's words.

    Parameters
    ----------
    text : str

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
    path = Path(text).expanduser()
    try:
        return open_any(text)
    except LensError as error:
        if path.exists():
            raise LensError(_without_commands(str(error))) from None
    near = () if path.suffix or path.parent != Path() else near_names(text)
    hint = f"did you mean {' or '.join(near)}?" if near else "the panel Library shows every lens"
    raise LensError(
        f"there is no file and no lens {text!r}: {hint}{'' if near else '; a file is found by its whole path'}"
    )


def _without_commands(words: str) -> str:
    """Leave out what only helps in a terminal: the page shows every lens by itself."""
    return words.replace(" (flarewright lenses lists them)", " of the panel Library")


def read_toml_of(path: Path) -> dict[str, object]:
    """Read TOML; a file that is none is told in one sentence."""
    try:
        return read_toml(path, "a project or lens file")
    except ValueError as error:
        raise ProjectError(str(error)) from None


def _is_project(data: dict[str, object]) -> bool:
    return "lights" in data or "lens" in data


@dataclass(frozen=True)
class Imported:
    """What a dropped file holds: one of a project, a look, a lens and a picture (its path), and what was noticed."""

    project: Project | None = None
    look: Look | None = None
    lens: Lens | None = None
    picture: str | None = None
    remarks: tuple[str, ...] = ()


def imported(name: str, data: bytes, folder: Path) -> Imported:
    """Take in a file that was dropped on the page.

    Parameters
    ----------
    name : str
        As the file is called; its ending says what it is.
    data : bytes
    folder : Path
        Where it is kept: pictures are read again later.

    Returns
    -------
    Imported

    Raises
    ------
    FlarewrightError
        When it is nothing that the editor reads; the message names the kinds that it does.
    """
    suffix = Path(name).suffix.lower()
    plain = Path(name).name or "dropped"
    if suffix not in (*LENS_SUFFIXES, *PICTURES):
        raise LensError(
            f"{plain} cannot be opened here: drop a lens (.toml, .lens, .zmx), a measured flare (.json), a project or "
            "a look (.toml), or a background picture (.exr, .png, .jpg)"
        )
    # a name of its own for other contents: what undo leads back to must stay as it was
    folder = folder / hashlib.sha256(data).hexdigest()[:12]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / plain
    write_atomically(path, lambda temporary: _write_bytes(temporary, data))
    if suffix in PICTURES:
        return Imported(picture=str(path))
    remarks: list[str] = []
    try:
        if suffix == ".toml":
            table = read_toml_of(path)
            if kind_of(table) == "look":
                return Imported(look=read_look(path))
            if _is_project(table):
                found = project_from_data(table, folder=folder, where=plain)
                check_any(found)
                for image in pictures(found):
                    if Path(image.path).parent == folder and not Path(image.path).is_file():
                        raise ProjectError(f"{image.path} does not exist")
                return Imported(project=found)
        if names_ghost_model(str(path)):
            return Imported(project=project_for_measured(str(path)))
        lens = load_lens(path, remarks=remarks)
    except FlarewrightError as error:
        # the folder is ours, and means nothing to a person
        words = _without_commands(str(error)).replace(str(path), plain)
        if str(folder) in words:
            words = f"{plain}: {words.replace(f'{folder}/', '')}; a dropped file comes alone, so use Open for this one"
        raise type(error)(words) from None
    return Imported(lens=lens.replace(name=lens.name or plain), remarks=tuple(remarks))


def _write_bytes(path: Path, data: bytes) -> None:
    path.write_bytes(data)


def project_path(text: str) -> Path:
    """Return the project file that a person means; `.toml` is added where it is missing."""
    if not text.strip():
        raise OutputError("the project needs a file name, like shot.toml")
    path = Path(text.strip()).expanduser()
    return (path if path.suffix.lower() == ".toml" else path.with_name(f"{path.name}.toml")).resolve()


def stamp_of(path: str | Path) -> str | None:
    """Return what tells the contents of a file from others; None where none can be read."""
    try:
        return _stamp(Path(path).read_bytes())
    except OSError:
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
        As `io.atomic.write_atomically`.

    Returns
    -------
    str
        The stamp of what was written; the file may have been changed by others since.

    Raises
    ------
    OutputError
        It cannot be written.
    FileExistsError
        When a file lies there that may not be replaced.
    """
    data = project_text(project, folder=path.parent).encode()
    write_atomically(path, lambda temporary: _write_bytes(temporary, data), look=look, replace=replace)
    return _stamp(data)


def command_line(file: str, project: Project) -> str:
    """Return the command that renders a saved project."""
    stem = Path(file).with_suffix("")
    quality = " --quality final" if project.quality.mode == "draft" else ""
    return f"flarewright render --project {shlex.quote(file)}{quality} -o {shlex.quote(f'{stem}.exr')}"


def export_picture(project: Project, path: Path, progress: Callable[[float, str], None] | None = None) -> None:
    """Render a project at its own size and quality into an EXR with its layers."""
    rendering = render_any(project, progress=progress)
    write_exr(
        path, rendering.layers, project.camera.size_px, pixel_type=project.output.pixel_type,
        scale=exr_scale(project), metadata={"version": __version__, "project": project_text(project)},
        pixel_aspect=rendering.project.camera.pixel_aspect, colorspace=project.output.colorspace,
    )  # fmt: skip


def lens_text(project: Project) -> str:
    """Return the project's lens as a lens file."""
    return format_lens(own_lens(project))


def ghost_csv(seen: Seen) -> str:
    """Return the ghosts of a picture as a table: brightest first, millimetres in the upright picture."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["ghost", "flux_mm2", "peak_irradiance", "rms_radius_mm", "x_mm", "y_mm"])
    width, height = seen.project.camera.sensor
    for ghost in seen.ghosts:
        x, y = (ghost.centre[0] - 0.5) * width, (0.5 - ghost.centre[1]) * height
        numbers = (ghost.flux, ghost.peak, ghost.size_mm, x, y)
        writer.writerow([ghost.name, *(f"{number:.6g}" for number in numbers)])
    return out.getvalue()
