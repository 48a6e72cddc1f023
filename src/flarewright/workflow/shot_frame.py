"""One frame of a shot: the project at its time, drawn, averaged over the open shutter, and written."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from .._version import __version__
from ..errors import FlarewrightError, OutputError, ProjectError
from ..io.files.text_file import digest_of
from ..io.images.exr import read_exr, write_exr
from ..io.images.exr_attributes import shot_attributes
from ..io.images.half import half_scale
from ..io.project.named_files import picture_files
from ..io.project.project_text import project_text
from ..io.project.spectrum_text import spectrum_text
from ..jobs.frame_list import FramePattern
from ..jobs.worker import WRITING
from ..measure.replay.measured_project import is_measured, render_measured
from ..model import Layer, Light, Project
from ..render.image.ocio_space import config_digest, in_file_space
from ..render.remarks import BLACK, DARK
from ..render.render import Rendering
from ..render.render import render as render_project
from ..render.scene.resolve import open_lens, resolve_project
from .frame_files import with_frame_files
from .keyframes import frame_rate, peak_intensity, project_at, still, time_of
from .motion_blur import MeanMatte, mean_layers, subframe_count, subframe_times

if TYPE_CHECKING:
    from .plates.plate_sources import PlateShot

# samples over the open shutter from which the number of sub-frames is chosen
_SAMPLES = 5


@dataclass(frozen=True)
class ShotPlan:
    """What all frames of a shot share; with a frame's number it determines the bytes of its file.

    Attributes
    ----------
    project : Project
        With its keyframes and curves; its timeline has the frames per second and the frame at 0 s.
    output : str
        File name with a place for the frame's number (`jobs.frame_list.FramePattern`).
    shutter_deg : float
        Angle of the shutter: 180 is open for half the time of a frame; 0 draws the moment of the frame.
    subframes : int or None
        Number of moments whose mean is drawn; None: from the motion (`motion_blur.subframe_count`).
    parts : {"multi", "single"}
        One part of the file for each layer, or one part with the channels of all.
    cropped : bool
        Single ghosts have their own data windows instead of the picture's.
    plate : PlateShot or None
        A plate whose sources are lights of the project.
    over : str
        File name of the comp of plate and flare, with a place for the frame's number; empty: none.
    radiance : bool
        The layers have the values of a picture that shows the radiance of the scene.
    """

    project: Project
    output: str
    shutter_deg: float = 0.0
    subframes: int | None = None
    parts: Literal["multi", "single"] = "multi"
    cropped: bool = False
    plate: PlateShot | None = None
    over: str = ""
    radiance: bool = False

    def path(self, frame: int) -> Path:
        """Return the file of a frame."""
        return FramePattern(self.output).path(frame)

    @property
    def open_s(self) -> float:
        """Time that the shutter is open, seconds."""
        return self.shutter_deg / 360.0 / float(frame_rate(self.project.timeline.fps))

    @property
    def scale(self) -> float:
        """Factor of the irradiances in all files: that of the brightest light at any time, so that it is constant.

        1 over a plate and for radiances: layers add to the picture of the scene as they are.
        """
        lit = self.plate is not None or self.project.lit_by_plate
        if lit or self.radiance or self.project.output.pixel_type == "float":
            return 1.0
        return half_scale(peak_intensity(self.project))


@dataclass(frozen=True)
class FrameResult:
    """What became of a frame.

    Attributes
    ----------
    frame : int
    file : str
    drawn : bool
        False: the file was there already, made by the same settings and version.
    subframes : int
    remarks : tuple of str
    """

    frame: int
    file: str
    drawn: bool
    subframes: int
    remarks: tuple[str, ...] = ()


def frame_project(plan: ShotPlan, at_s: float) -> Project:
    """Return what is drawn at a time: the project without keyframes, with the values that they have then."""
    return _moment(plan, at_s)[0]


def _moment(plan: ShotPlan, at_s: float) -> tuple[Project, float]:
    """Return what is drawn at a time, and the part of the plate's light where the lens images nothing."""
    timeline = plan.project.timeline
    # a time is a rounded number of frames
    frame = round(timeline.start + at_s * float(frame_rate(timeline.fps)), 6)
    project = with_frame_files(still(project_at(plan.project, at_s)), frame)
    if plan.radiance:
        from .plates.plate_frame import with_radiances

        return with_radiances(project), 0.0
    if plan.plate is None:
        return project, 0.0
    # imports SciPy, which frames without a plate do not need
    from .plates.plate_frame import with_plate_lights

    return with_plate_lights(project, plan.plate, frame)


def draw_frame(plan: ShotPlan, frame: int, threads: int | None = None) -> FrameResult:
    """Draw and write one frame, unless its file is there already.

    Parameters
    ----------
    plan : ShotPlan
    frame : int
        Its number.
    threads : int, optional
        None: all cores. The bytes do not depend on it.

    Raises
    ------
    FlarewrightError
        The project cannot be drawn at this frame, or the file cannot be written; the sentence names the frame.
    """
    path = plan.path(frame)
    try:
        moments = _moments(plan, frame)
        digest = _digest(plan, frame, moments)
        files = [path, FramePattern(plan.over).path(frame)] if plan.over else [path]
        made_by = {file: _made_by(file) for file in files if file.exists()}
        if all(made_by.get(file) == digest for file in files):
            return FrameResult(frame, str(path), False, len(moments))
        rendering = _draw(moments, threads)
        _write(plan, frame, moments, rendering, digest)
    except OutputError:
        # names the file
        raise
    except FlarewrightError as error:
        raise type(error)(f"frame {frame}: {error}", error.problems) from None
    again = [f"{file} was damaged or of another program; it was replaced" for file, by in made_by.items() if by is None]
    return FrameResult(frame, str(path), True, len(moments), (*again, *_lost(plan, frame), *rendering.remarks))


def _lost(plan: ShotPlan, frame: int) -> tuple[str, ...]:
    """Return a remark on sources of the plate where the lens images nothing."""
    lost = 0.0 if plan.plate is None else _moment(plan, time_of(frame, plan.project.timeline))[1]
    if lost <= 0.0:
        return ()
    return (f"{lost:.2%} of the plate's light lies where the lens images nothing, and is left out",)


def part_name(layer: str) -> str:
    """Return a layer's name in letters, digits and underscores, with two digits a row.

    Examples
    --------
    >>> part_name("ghost.7-3"), part_name("ghosts.order4+"), part_name("ghost.sensor-12")
    ('ghost_07_03', 'ghosts_order4_plus', 'ghost_sensor_12')
    """
    if layer.startswith("ghost."):
        layer = re.sub(r"\d+", lambda number: f"{int(number[0]):02d}", layer)
    return re.sub(r"\W", "_", layer.replace("+", "_plus"))


def _moments(plan: ShotPlan, frame: int) -> tuple[Project, ...]:
    """Return the project at each sub-frame."""
    at_s = time_of(frame, plan.project.timeline)
    if plan.shutter_deg == 0.0 or plan.subframes == 1:
        return (frame_project(plan, at_s),)
    number = plan.subframes
    if number is None:
        samples = [at_s + plan.open_s * (k / (_SAMPLES - 1) - 0.5) for k in range(_SAMPLES)]
        projects = [frame_project(plan, sample) for sample in samples]
        # brightness and colour change without motion; the samples are enough for them
        still_bright = all(project == projects[0] for project in projects)
        if plan.plate is not None:
            from .plates.plate_frame import alike_lights

            projects = alike_lights(projects)
        number = 1 if still_bright else max(_SAMPLES, subframe_count(projects))
    moments = [frame_project(plan, moment) for moment in subframe_times(at_s, plan.open_s, number)]
    if moments[0].quality.mode == "reference":
        # independent errors, which the mean reduces
        moments = [
            project.replace(quality=project.quality.replace(seed=project.quality.seed + k))
            for k, project in enumerate(moments)
        ]
    return tuple(moments)


def _digest(plan: ShotPlan, frame: int, moments: tuple[Project, ...]) -> str:
    """Return a digest of all that determines a file: version, projects, contents of their files, kind of file."""
    timeline = plan.project.timeline
    lens = moments[0].lens
    # the flare does not depend on the picture under it, which another machine may lack
    bare = [project.replace(plate=None) for project in moments]
    images = {name for project in bare for name in picture_files(project)}
    if is_measured(moments[0]):
        content = digest_of(str(lens))
    else:
        opened = open_lens(lens).lens
        content = opened.model_dump_json()
        images.update(picture_files(opened))
    made_of: dict[str, Any] = {
        "version": __version__,
        "moments": [project.model_dump(mode="json", exclude={"lens"}) for project in bare],
        "lens": content,
        "files": {name: digest_of(name) for name in images},
        "frame": [frame, str(frame_rate(timeline.fps)), plan.open_s],
        "file": [plan.scale, plan.parts, plan.cropped, config_digest(moments[0])],
    }
    if plan.plate is not None:
        settings = plan.plate.settings
        made_of["comp"] = [
            bool(plan.over),
            plan.plate.threshold,
            settings.highlights,
            settings.layer,
            settings.transfer,
        ]
        from .plates.plate_files import plate_digest

        matte = [] if settings.matte is None else [digest_of(FramePattern(settings.matte).path(frame))]
        # a flare alone carries attributes of its plate
        made_of["plate"] = [plate_digest(settings, frame), *matte]
    return sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()


def _made_by(path: Path) -> str | None:
    """Return the digest in a file, checked with all its pixels; None for a damaged or foreign file."""
    try:
        return read_exr(path).metadata.get("digest")
    except (FlarewrightError, KeyError):
        return None


def _draw(moments: tuple[Project, ...], threads: int | None) -> Rendering:
    """Return the picture of a moment, or the mean of several."""
    first = _render(moments[0], threads)
    if len(moments) == 1:
        return first
    output = moments[0].output
    brightest = output.brightest if output.layers == "ghosts" else None
    mattes = MeanMatte(output.matte_ranks) if first.matte is not None else None

    def layers() -> Iterator[tuple[Layer, ...]]:
        for k, project in enumerate(moments):
            # which ghosts are the brightest differs between moments: all are averaged, then chosen
            whole = project.replace(output=project.output.replace(brightest=None))
            drawn = first if k == 0 and brightest is None else _render(whole, threads)
            if mattes is not None and drawn.matte is not None:
                mattes.add(drawn.matte)
            yield drawn.layers

    mean = list(mean_layers(layers(), moments[0].camera.size_px, len(moments)))
    if brightest is not None:
        singles = [layer for layer in mean if layer.name.startswith("ghost.")]
        singles.sort(key=lambda layer: -float(layer.pixels.sum(dtype="f8")))
        dropped = {layer.name for layer in singles[brightest:]}
        mean = [layer for layer in mean if layer.name not in dropped]
    # a lamp may be switched on after the first moment
    lit = any(layer.pixels.any() for layer in mean)
    remarks = tuple(remark for remark in first.remarks if not (lit and remark in (BLACK, DARK)))
    matte = None if mattes is None else mattes.mean()
    return replace(first, layers=tuple(mean), remarks=remarks, matte=matte)  # type: ignore[arg-type]


def _render(project: Project, threads: int | None) -> Rendering:
    if is_measured(project):
        return render_measured(project)
    return render_project(project, threads=threads)


def _write(plan: ShotPlan, frame: int, moments: tuple[Project, ...], rendering: Rendering, digest: str) -> None:
    """Write a frame, atomically; see `jobs.worker.WRITING`."""
    # the moment in the middle stands for the frame
    shown = moments[len(moments) // 2]
    project = rendering.project
    metadata = {
        "version": __version__,
        "project": project_text(shown, folder=plan.path(frame).parent),
        "digest": digest,
        "frame": str(frame),
        "subframes": str(len(moments)),
        "lights": json.dumps([_light_facts(light) for light in shown.lights]),
    }
    attributes = shot_attributes(
        frame=frame, fps=frame_rate(plan.project.timeline.fps), shutter_s=plan.open_s, **_facts(shown)
    )
    if plan.plate is not None:
        from .plates.plate_frame import comp_attributes, write_comp

        attributes |= comp_attributes(plan.plate, frame)
    layers, space = in_file_space(rendering.layers, project)
    names = [part_name(layer.name) for layer in layers]
    if len(set(names)) < len(names):
        raise ProjectError(f"two layers would have one name among {', '.join(names)[:200]}")
    with WRITING:
        write_exr(
            plan.path(frame),
            [replace(layer, name=name) for layer, name in zip(layers, names, strict=True)],
            project.camera.size_px,
            pixel_type=project.output.pixel_type,
            scale=plan.scale,
            metadata=metadata,
            pixel_aspect=project.camera.pixel_aspect,
            colorspace=space,
            full_windows=not plan.cropped,
            one_part=plan.parts == "single",
            compression=project.output.compression,
            attributes=attributes,
            matte=rendering.matte,
        )
        if plan.plate is not None and plan.over:
            over = FramePattern(plan.over).path(frame)
            # its project starts at its own folder
            facts = {**metadata, "project": project_text(shown, folder=over.parent)}
            write_comp(over, plan.plate, frame, rendering.layers, project, facts, attributes)


def _light_facts(light: Light) -> dict[str, Any]:
    """Return what the header states of a light."""
    # a table has no short text
    spectrum = spectrum_text(light.spectrum) or light.spectrum.model_dump(mode="json")
    facts: dict[str, Any] = {
        "field_deg": light.field_deg, "intensity": light.intensity, "spectrum": spectrum,
        "diameter_deg": light.diameter_deg,
    }  # fmt: skip
    if light.shape is not None:
        facts["shape"] = light.shape.model_dump(mode="json")
    if light.distance is not None:
        facts["distance_mm"] = light.distance
    return facts


def _facts(project: Project) -> dict[str, Any]:
    """Return what the camera's attributes state; nothing of a measured flare, whose lens is unknown."""
    if is_measured(project):
        return {"f_number": project.f_number}
    settled = resolve_project(project)
    return {
        "focal_length": settled.order.efl,
        "f_number": settled.order.f_number,
        "focus_distance": project.camera.focus_distance,
        "lens": settled.lens.name,
    }
