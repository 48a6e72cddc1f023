"""`flarewright render`: render the flare of a lens and a light as a layered, linear picture."""

from __future__ import annotations

import errno
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import FlarewrightError, OutputError, ProjectError
from ..common import check_place, first_run_bar, one_bar, print_json, print_remark, print_remarks
from ..option_record import with_options
from .options.record import RenderOptions
from .preview import PreviewLook, check_exposure, preview_look, write_preview

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...model import Project
    from ...model.project.reference_state import ReferenceState
    from ...render.image.partial_picture import PartialPicture
    from ...render.reference.energy_ledger import Ledger
    from ...render.reference.estimator import ReferenceRun
    from ...render.render import Rendering

EPILOG = (
    "Examples:\n\nflarewright render takumar-50-f1.4 --light -9,5 -o flare.exr\n\n"
    "flarewright render canon-28-80 --light -8,3 --light 2,6 --intensity 1 --intensity 0.2 --spectrum black-body:3200 "
    "--fstop 8 --blades 7 --coating quarter-wave:550 --size 1920x1080 --layers ghosts --brightest 30 "
    "-o shot.exr\n\n"
    "flarewright render heliar-tronnier --light sun@10,5 --light -12,2 --light-size 3x2 --distance inf --distance 900 "
    "--spectrum d65 --spectrum rgb:1,0.6,0.2 -o room.exr\n\n"
    "flarewright render model.json --light 12,7 --mute 3 -o measured.exr\n\n"
    "flarewright render --project shot.toml --quality draft -o test.exr"
)


@with_options(RenderOptions)
def render(options: RenderOptions) -> None:
    """Render the flare of a lens into a layered, linear EXR, with a PNG preview.

    Every value is an irradiance on the sensor relative to a light of irradiance 1, so layers add up to the beauty.
    A file of half floats holds the value times a power of two, its attribute flarewright.scale.
    """
    from ...render.image.ocio_space import check_file_space

    check_place(options.output, ".exr")
    view_of = preview_look(options)
    state = _read_state(options.resume)
    flags, settings, remarks = project_of_options(options, state)
    check_exposure(view_of, settings)
    remarks += check_file_space(settings)
    run = _reference_run(options, settings, state)
    kept = _kept_part(options, settings)
    pictures = [options.output] if options.no_png else [options.output, options.output.with_suffix(".png")]
    keep_inputs(settings, options.project, pictures)
    from .art_flags import naming_rules

    try:
        with naming_rules(flags, settings):
            rendering = _render(settings, options, run, kept)
    except KeyboardInterrupt:
        if kept is not None and kept.size_bytes:
            print_remarks(
                [f"to resume: the same command; {kept.folder} holds {kept.size_bytes / 1e6:.0f} MB until then"]
            )
        if run is not None and run.state_file is not None and run.state_file.exists():
            print_remarks([f"to resume: flarewright render --resume {run.state_file} -o {options.output}"])
        raise
    except FlarewrightError:
        # the next run would meet it again
        if kept is not None:
            kept.remove()
        raise
    files, written = _written(rendering, options, view_of, kept)
    remarks = [*_without_effect(options, settings), *remarks, *rendering.remarks, *written]
    if run is not None and run.state_file is not None and run.state_file.exists():
        remarks.append(f"to reach a smaller --error: --resume {run.state_file}")
    print_remarks(remarks)
    if rendering.ledger is not None:
        _print_ledger(rendering.ledger)
    profiled = {}
    if rendering.profile is not None:
        from .profile_table import print_profile

        print_profile(rendering.profile)
        profiled = {"profile": rendering.profile.as_data()}
    if options.as_json:
        print_json({**rendering.summary, **profiled, **files, "remarks": remarks})
    else:
        print_remarks(f"wrote {name}" for name in (files["output"], files.get("preview")) if name)


def project_of_options(
    options: RenderOptions, state: ReferenceState | None, timeline: dict[str, Any] | None = None
) -> tuple[RenderOptions, Project, list[str]]:
    """Build the project that the options ask for; return them with their look, the project and remarks.

    Parameters
    ----------
    options : RenderOptions
    state : ReferenceState or None
        Of a picture that resumes.
    timeline : dict, optional
        Of a shot: its frames per second and the number of its frame at 0 s, where they are given. Lights of
        `--light-px` then stay at their pixels while the lens moves.
    """
    _check_bits(options)
    from ...io.project.project_file import read_project
    from .framing import framed
    from .look_flags import flags_with_look, photographed, settings_of
    from .project_flags import build_project, known_lights, project_of
    from .sun_light import sun_remark
    from .tracks import given_tracks, with_given_tracks, with_lights, with_pixel_lights

    _check_places(options, timeline)
    base = options.base
    if options.project is not None:
        base = base or read_project(options.project)
    elif state is not None:
        base = state.project
    start = (timeline or {}).get("start", 1 if base is None else base.timeline.start)
    flags = replace(options, base=base, tracked=given_tracks(options, start))
    given, plain = settings_of(flags), options.ideal or options.project is not None or state is not None
    remarks: list[str] = []
    if options.look is not None:
        flags, of_look, unfit = flags_with_look(flags, options.look)
        given, remarks = given | of_look, list(unfit)
    if flags.tracked:
        known = known_lights(flags, () if flags.base is None else flags.base.lights)
        flags = replace(flags, tracked=with_lights(flags.tracked, [light.get("name", "light") for light in known]))
    settings = build_project(flags)
    if not plain:
        settings, filled = photographed(settings, given)
        remarks = [*filled, *remarks]
    settings, counted_px, framing = framed(settings, options)
    remarks += [*framing, *sun_remark(options)]
    if timeline:
        settings = project_of({**dict(settings), "timeline": {**dict(settings.timeline), **timeline}})
    if flags.tracked:
        settings, found = with_given_tracks(
            settings, flags, counted_px, fps_given="fps" in (timeline or {}), start_given="start" in (timeline or {})
        )
        remarks += found
    if timeline is None:
        settings, moment = _at_moment(settings, options)
        remarks = [*moment, *remarks]
    if options.light_px:
        settings, found = with_pixel_lights(
            settings, options, len(options.light), counted_px, over_time=timeline is not None
        )
        remarks += found
    return flags, settings, remarks


def _check_bits(options: RenderOptions) -> None:
    """Raise an error for options that set the bits per value of the EXR differently."""
    if options.half and options.float32:
        raise ProjectError("--half and --float both set the bits per value; keep one")
    if options.float32 and options.compression == "dwaa":
        raise ProjectError("--compression dwaa keeps 16 bits of a value and --float writes 32; keep one")


def _check_places(options: RenderOptions, timeline: dict[str, Any] | None) -> None:
    """Raise an error for options on places of lights that have no effect together."""
    from .sun_light import check_aim
    from .tracks import px_origin

    check_aim(options)
    px_origin(options.px_origin)
    if options.px_origin is not None and not (options.light_px or options.track):
        raise ProjectError("--px-origin is the corner of --light-px and --track; add one of them, or leave it out")
    if options.track and timeline is None and options.frame is None and options.at_s is None:
        raise ProjectError("--track is the path of a light over time: add --frame N, or draw all with flarewright shot")
    if options.resume is not None:
        for flag, value in (
            ("--light-px", options.light_px), ("--track", options.track), ("--sun", options.sun),
            ("--crop", options.crop), ("--overscan", options.overscan),
        ):  # fmt: skip
            if value:
                raise ProjectError(f"--resume continues a picture with its settings; omit {flag}")


def _at_moment(project: Project, options: RenderOptions) -> tuple[Project, list[str]]:
    """Return the project of --frame or --time, if one is given, and a remark that names the moment."""
    from ...model.project.animation import LAST_S
    from ...workflow.frame_files import check_holdout_frames, holdout_sequences, with_frame_files
    from ...workflow.keyframes import frame_rate, is_still, length_s, project_at, still, time_of

    sequences = holdout_sequences(project)
    if options.frame is None and options.at_s is None:
        if sequences:
            raise ProjectError(
                f"the holdout {sequences[0].text} is a sequence: add --frame N, or draw all with flarewright shot"
            )
        return project, []
    if options.frame is not None and options.at_s is not None:
        raise ProjectError("--frame and --time both choose the moment; keep one")
    if options.resume is not None:
        raise ProjectError("--resume continues a picture with its settings; omit --frame and --time")
    if is_still(project) and not sequences:
        return project, ["nothing in the project moves: --frame and --time have no effect"]
    if options.frame is not None:
        at_s = time_of(options.frame, project.timeline)
        words = f"frame {options.frame}, {at_s:g} s ({project.timeline.fps:g} frames per second)"
    else:
        assert options.at_s is not None
        at_s, words = options.at_s, f"the moment {options.at_s:g} s"
    # a sequence of holdouts alone has any numbers
    if not 0.0 <= at_s <= LAST_S and not (is_still(project) and options.frame is not None):
        flag = "--frame" if options.frame is not None else "--time"
        raise ProjectError(
            f"{flag}: {at_s:g} s lies outside the time of a project, 0 to {LAST_S:g} s; the frame at 0 s is "
            f"{project.timeline.start}"
        )
    last_s = length_s(project)
    # times of frames are rounded
    rests = at_s > last_s + 1e-6 and not is_still(project)
    words += f" is drawn{f'; everything rests after the last key at {last_s:g} s' if rests else ''}"
    frame = options.frame
    if frame is None:
        frame = round(project.timeline.start + at_s * float(frame_rate(project.timeline.fps)))
    check_holdout_frames(project, [frame])
    return with_frame_files(still(project_at(project, at_s)), frame), [words]


def _without_effect(options: RenderOptions, settings: Project) -> list[str]:
    """Return a remark for each option that has no effect on this project."""
    remarks = []
    if options.order4_limit is not None and settings.quality.orders != 4:
        remarks.append("--order4-limit has no effect without ghosts of four reflections: add --orders 4")
    if options.full_windows and settings.output.layers != "ghosts":
        remarks.append("--full-windows has no effect without layers of single ghosts: add --layers ghosts")
    if options.brightest is not None and settings.output.layers != "ghosts":
        remarks.append("--brightest has no effect without layers of single ghosts: add --layers ghosts")
    if options.matte_ranks is not None and settings.output.matte == "none":
        remarks.append("--matte-ranks has no effect without a matte: add --matte ghosts")
    if options.orders == 4 and settings.quality.mode == "draft":
        remarks.append("draft quality draws ghosts of two reflections only: --orders 4 is for final quality")
    if options.ringing == "collins" and settings.quality.mode != "final":
        remarks.append(f"{settings.quality.mode} quality has no rings: --ringing is for final quality")
    moving = [f"light {k}" for k, light in enumerate(settings.lights) if light.keyframes or light.curves]
    moving += [curve.of for curve in settings.curves]
    if moving:
        remarks.append(
            f"one frame is drawn, with the plain values of the project; keys of {', '.join(moving)} are left out: "
            "--frame N or --time S draws one of them, flarewright shot all"
        )
    if settings.plate is not None:
        comp = "; flarewright shot --over writes the comp" if settings.plate.lit else ""
        remarks.append(f"the plate is not drawn, only the flare{comp}")
    return remarks


def keep_inputs(settings: Project, project_file: Path | None, outputs: list[Path]) -> None:
    """Raise an error if an output would replace an input file."""
    from ...io.project.named_files import picture_files

    read = [project_file, settings.lens if isinstance(settings.lens, str) else None, *picture_files(settings)]
    sources = [source for source in read if source is not None and Path(source).exists()]
    for output in outputs:
        if output.exists() and any(output.samefile(source) for source in sources):
            raise ProjectError(f"{output} would replace an input file; choose another name for -o")


def _read_state(path: Path | None) -> ReferenceState | None:
    if path is None:
        return None
    from ...io.render_state.reference_state import read_reference_state

    return read_reference_state(path)


def _reference_run(options: RenderOptions, project: Project, state: ReferenceState | None) -> ReferenceRun | None:
    """Check the options of reference quality; None for the other qualities."""
    time_limit = options.time_limit
    if time_limit is not None and not 0.0 < time_limit < float("inf"):
        raise ProjectError(f"--time-limit {time_limit:g} is no time; give seconds above 0")
    if project.quality.mode != "reference":
        given = {
            "--resume": state, "--time-limit": time_limit, "--error": options.error, "--error-of": options.error_of,
            "--samples": options.samples, "--rays-from": options.rays_from,
        }  # fmt: skip
        for flag in (flag for flag, value in given.items() if value is not None):
            raise ProjectError(
                f"{flag} works with --quality reference only, not with {project.quality.mode}; add it or omit {flag}"
            )
        return None
    from ...io.render_state.reference_state import SUFFIX
    from ...render.reference.estimator import ReferenceRun

    output = options.output
    return ReferenceRun(state, output.with_name(output.stem + SUFFIX), time_limit)


def _kept_part(options: RenderOptions, project: Project) -> PartialPicture | None:
    """Return where a final render keeps its finished ghosts; None for the other qualities, and when costs are timed."""
    from ...io.files.file_kind import is_ghost_model_file

    if project.quality.mode != "final" or options.profile or is_ghost_model_file(project.lens):
        return None
    from ...render.image.partial_picture import SUFFIX, PartialPicture

    return PartialPicture(options.output.with_suffix(SUFFIX), print_remark)


def _print_ledger(ledger: Ledger) -> None:
    """Print the ledger as a table to stderr."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"Where the light went: {ledger.entered_mm2:.6g} mm² entered")
    table.add_column("light")
    table.add_column("share of the light", justify="right")
    table.add_column("standard error", justify="right")
    for line in ledger.lines:
        table.add_row(line.words, f"{line.share:.6%}", f"{line.standard_error:.1e}")
    table.add_section()
    table.add_row("sum", f"{ledger.total.share:.6%}", f"{ledger.total.standard_error:.1e}")
    Console(stderr=True, markup=False, highlight=False).print(table)


def _render(
    project: Project, options: RenderOptions, run: ReferenceRun | None, kept: PartialPicture | None
) -> Rendering:
    """Render with a progress bar on a terminal."""
    draw = _renderer(project, options, run, kept)
    with one_bar("rendering") as progress:
        return draw(progress=progress)


def _renderer(
    project: Project, options: RenderOptions, run: ReferenceRun | None, kept: PartialPicture | None
) -> Callable[..., Rendering]:
    """Return the render function of a project, of a lens or of a measured flare; it takes a progress callback."""
    from ...io.files.file_kind import is_ghost_model_file

    if is_ghost_model_file(project.lens):
        from ...measure.replay.measured_project import render_measured

        flags = {"--ledger": options.ledger, "--profile": options.profile, "--ringing": options.ringing is not None}
        for flag, given in flags.items():
            if given:
                raise ProjectError(f"{project.lens} is a measured flare, which has no {flag[2:]}; omit {flag}")
        return partial(render_measured, project)
    from ...render.render import render as render_project
    from ...render.warmup import compile_for_render

    if options.profile and project.quality.mode != "final":
        raise ProjectError(f"--profile is for final quality, not for {project.quality.mode}; omit it")
    compile_for_render(project, options.threads, print_remark, first_run_bar)
    return partial(
        render_project, project, threads=options.threads, run=run, ledger=options.ledger, profile=options.profile,
        kept=kept,
    )  # fmt: skip


def _written(
    rendering: Rendering, options: RenderOptions, look: PreviewLook | None, kept: PartialPicture | None
) -> tuple[dict[str, Any], list[str]]:
    """Write the files and delete the kept part; on a full disk, the files get its space. Returns as `_write`."""
    write = partial(_write, rendering, options.output, options.full_windows, look)
    if kept is None:
        return write()
    try:
        done = write()
    except OutputError as error:
        cause = error.__cause__
        if not (kept.size_bytes and isinstance(cause, OSError) and cause.errno in (errno.ENOSPC, errno.EDQUOT)):
            raise
        kept.remove()
        return write()
    kept.remove()
    return done


def _write(
    rendering: Rendering, output: Path, full_windows: bool, look: PreviewLook | None
) -> tuple[dict[str, Any], list[str]]:
    """Write the EXR and its preview; return the files by kind, and remarks."""
    from ... import __version__
    from ...io.images.cryptomatte import NAME
    from ...io.images.exr import write_exr
    from ...io.images.half import exr_scale
    from ...io.project.project_text import project_text
    from ...render.image.gamut import negative_share
    from ...render.image.ocio_space import in_file_space

    project = rendering.project
    width, height = project.camera.size_px
    scale = exr_scale(project)
    layers, space = in_file_space(rendering.layers, project)
    remarks = list(
        write_exr(
            output,
            layers,
            (width, height),
            pixel_type=project.output.pixel_type,
            scale=scale,
            metadata={"version": __version__, "project": project_text(project, folder=output.parent)},
            pixel_aspect=project.camera.pixel_aspect,
            colorspace=space,
            full_windows=full_windows,
            compression=project.output.compression,
            matte=rendering.matte,
        )
    )
    outside = negative_share(layers[0])
    if outside > 0.0:
        remarks.append(
            f"{round(outside * width * height)} of {width * height} pixels have a negative channel: colours outside "
            "the file's primaries; --gamut compress writes none"
        )
    files: dict[str, Any] = {
        "output": str(output), "layers": [layer.name for layer in rendering.layers], "scale": scale,
        "negative_pixels": outside,
    }  # fmt: skip
    if rendering.matte is not None:
        files["matte"] = {"name": NAME, "objects": len(rendering.matte.names), "ranks": len(rendering.matte.light)}
    if look is not None:
        shown, missed = write_preview(rendering, output.with_suffix(".png"), look)
        files |= shown
        remarks += [f"the preview shows {files['view']}", *missed]
    return files, remarks
