"""The renderer: from a project to layers. The command line and the library both call `render`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from math import isfinite, prod
from os import PathLike
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from ..errors import ProjectError
from ..io.images.mask_image import read_mask
from ..model import Layer, Lens, Project
from ..model.matte import GhostMatte
from ..optics.lens.paths import ghost_paths
from ..typing import Floats, Progress
from .ghosts.cost import CostMeter, RenderProfile
from .ghosts.final_ghosts import plain_level
from .ghosts.ghost_pass import render_ghosts
from .image.compose import beauty
from .image.gamut import apply_gamut
from .image.ghost_ranking import RANK_BYTES, GhostRanking, ghost_matte, rank_remarks
from .image.shown_layer import ShownLayer, shown_layers
from .progress_parts import progress_parts
from .remarks import black_remarks, ghost_veil_remarks, mask_remarks, percent, scene_remarks
from .scattering.scatter_pass import render_scatter, scatter_facts, scatter_of, without_scattered
from .scene.arguments import Settings, naming_settings, project_of
from .scene.art_rules import ResolvedArt, has_overrides, resolve_art, with_gain
from .scene.direct_image import direct_image
from .scene.memory_check import check_memory, spare_bytes
from .scene.opening import Opening, make_opening, soiled_opening
from .scene.placement_remarks import outside_remarks
from .scene.resolve import ResolvedProject, resolve_project
from .scene.shot import Shot
from .scene.shots import make_shots
from .starburst.starburst_pass import read_soil, starburst_of
from .summary import summary_of

if TYPE_CHECKING:
    from ..optics.diffraction.fraunhofer import Soil
    from .image.partial_picture import PartialPicture
    from .reference.energy_ledger import Ledger
    from .reference.estimator import ReferenceRun


PARALLEL_PX = 1_000_000
"""A larger picture's starburst is not computed in parallel with its ghosts: both at once need 100 MB more at 1080p."""
PIXEL_BYTES = 12
"""Memory of a layer per pixel: three float32."""
# passes in their order, with typical times
_TIMES = {"ghosts": 10.0, "search": 2.0, "fours": 10.0, "scatter": 4.0, "starburst": 1.0}


@dataclass(frozen=True)
class Rendering:
    """A finished render.

    Attributes
    ----------
    project : Project
    layers : tuple of ShownLayer
        "beauty" first, then the requested passes and single ghosts.
    summary : dict
        Facts about lens and picture, as JSON data.
    remarks : tuple of str
        Sentences for the user: repairs, estimates, and light that was left out.
    ledger : Ledger or None
        The energy ledger, if requested.
    profile : RenderProfile or None
        What each ghost cost, if requested.
    matte : GhostMatte or None
        The brightest ghosts of each pixel, with `Output.matte`.
    """

    project: Project = field(repr=False)
    layers: tuple[ShownLayer, ...]
    summary: dict[str, Any] = field(repr=False)
    remarks: tuple[str, ...]
    ledger: Ledger | None = None
    profile: RenderProfile | None = None
    matte: GhostMatte | None = field(default=None, repr=False)

    def _repr_png_(self) -> bytes:
        """Return the beauty as PNG for notebooks, with the display of the PNG beside an EXR."""
        from .image.display import layers_exposure

        return self.layers[0].png(layers_exposure(self.layers, self.project.output.colorspace))


@naming_settings
def render(
    project: Project | Lens | str | PathLike[str],
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    run: ReferenceRun | None = None,
    ledger: bool = False,
    profile: bool = False,
    kept: PartialPicture | None = None,
    **settings: Unpack[Settings],
) -> Rendering:
    """Render the flare of a project, or of a lens with a few settings.

    Parameters
    ----------
    project : Project, Lens, str or path
        A project, a prescription, the name of a shipped lens, or a lens file. All but a project need the setting
        `lights`.
    threads : int, optional
        None: all cores. The pixels do not depend on it.
    progress : callable, optional
        Called with the finished part (0 to 1) and the name of the step.
    run : ReferenceRun, optional
        Reference quality: the state to resume, where to save it, and the time limit.
    ledger : bool
        Whether to compute the energy ledger. It costs about a second; in reference quality nothing.
    profile : bool
        Final quality: whether to time the stages of each ghost and count its work.
    kept : PartialPicture, optional
        Final quality: keeps the drawn ghosts in files, from which the next render of the same project resumes.
    **settings : Settings
        Fields of `Project` by name; they override the fields of a given project. `coating` also accepts the texts of
        the command line's `--coating`, such as "early-multicoat", "preset:staggered" or a coating file.

    Returns
    -------
    Rendering
        Layers of irradiance on the sensor, in units of the irradiance from a light of intensity 1 on a plane facing it
        (docs/physics.md, "Radiometry").

    Raises
    ------
    FlarewrightError
        The project cannot be rendered; the message says what, where, and the remedy.
    MemoryError
        The layers need more memory than there is.

    Examples
    --------
    >>> from flarewright import Light, render
    >>> render("canon-28-80", f_number=8, coating="early-multicoat", lights=[Light(field_deg=(10, 5))]) # doctest: +SKIP
    """
    project = project_of(project, **settings)
    costs = CostMeter() if profile and project.quality.mode == "final" else None
    ranking = _checked(project)
    settled = resolve_project(project)
    mask = None if settled.iris.mask is None else read_mask(settled.iris.mask)
    # rules that select no ghost are errors in every quality
    resolved = resolve_art(settled)
    # reference quality ignores art direction
    art = ResolvedArt() if project.quality.mode == "reference" else resolved
    opening = make_opening(settled, mask)
    shots = make_shots(settled, opening)
    tables = scatter_of(settled, shots)
    soil = read_soil(project.dirt)
    seen = _through_iris(settled, shots, opening, soil)
    images = [direct_image(settled.lens, shot) for shot in shots]
    stars = images if tables is None else without_scattered(images, tables)
    starburst: Callable[[], Layer] = partial(starburst_of, settled, shots, stars, mask, soil, threads=threads)
    parts = _parts(project, tables is not None, progress)
    if project.quality.mode == "reference":
        drawn = _reference(settled, mask, run, threads, parts["ghosts"])
    else:
        if project.output.starburst and prod(project.camera.size_px) <= PARALLEL_PX:
            starburst = _start_early(starburst, threads)
        drawn = _ghosts(settled, seen, art, _Work(threads, parts, costs, kept, ranking))
    passes = list(drawn.passes)
    scattered: dict[str, Any] = {}
    scatter_remarks: tuple[str, ...] = ()
    if tables is not None:
        if project.quality.mode != "reference":
            passes.append(render_scatter(settled, shots, images, tables, threads=threads, progress=parts["scatter"]))
        facts, scatter_remarks = scatter_facts(settled, tables)
        scattered = {"scatter": facts}
    if project.output.starburst:
        passes.insert(0, _reported(starburst, "starburst", parts["starburst"]))
    # overflow raises an error below
    with np.errstate(over="ignore", invalid="ignore"):
        passes = [with_gain(layer, art.gain.get(layer.name.removesuffix(".order4"), 1.0)) for layer in passes]
        others = [with_gain(layer, art.gain.get("ghosts", 1.0)) for layer in drawn.others]
        plain = passes
        passes, others = apply_gamut(project.output.gamut, passes), apply_gamut(project.output.gamut, others)
        whole = beauty(passes, project.camera.size_px)
    layers = (whole,) if project.output.layers == "beauty" else (whole, *passes, *others)
    # the beauty is infinite wherever a pass is
    check_finite((whole, *others))
    matte = None if ranking is None else _matte(ranking, plain, project, art)
    account = drawn.ledger
    if ledger and account is None:
        from .reference.energy_ledger import trace_ledger

        account = trace_ledger(shots, project.quality.seed, scatter=tables, threads=threads)
    summary = {**summary_of(settled, shots, stars, art), **drawn.facts, **scattered}
    return Rendering(
        settled.project,
        shown_layers(layers, settled.project),
        {**summary, "ledger": account.as_data()} if ledger and account is not None else summary,
        (
            *settled.remarks,
            *drawn.remarks,
            *scatter_remarks,
            *black_remarks(settled, shots, passes),
            *outside_remarks(shots, images),
            *(() if matte is None else rank_remarks(matte)),
            *ghost_veil_remarks(drawn.passes),
            *scene_remarks(settled, seen),
            *mask_remarks(mask),
        ),
        account if ledger else None,
        None if costs is None else RenderProfile(costs.search_s, costs.costs()),
        matte,
    )


def _parts(project: Project, scatters: bool, progress: Progress | None) -> dict[str, Progress | None]:
    """Return the progress of each pass of a render."""
    final, fours = project.quality.mode == "final", project.quality.orders == 4
    drawn = {
        "ghosts": True,
        "search": final and fours,
        "fours": final and fours,
        "scatter": scatters and project.quality.mode != "reference",
        "starburst": project.output.starburst,
    }
    return progress_parts(progress, {name: time if drawn[name] else 0.0 for name, time in _TIMES.items()})


def _reported(work: Callable[[], Layer], name: str, progress: Progress | None) -> Layer:
    """Do work of one step, and report its start and its end."""
    if progress is not None:
        progress(0.0, name)
    layer = work()
    if progress is not None:
        progress(1.0, name)
    return layer


def _through_iris(
    settled: ResolvedProject, shots: tuple[Shot, ...], opening: Opening, soil: Soil | None
) -> tuple[Shot, ...]:
    """Return the shots as ghosts see the iris: with its dirt, and with the rings of its edges, as the project asks."""
    project, semi = settled.project, settled.order.stop_semi_diameter
    if soil is not None and project.dirt.in_ghosts:
        opening = soiled_opening(opening, semi, soil)
        shots = tuple(replace(shot, opening=opening) for shot in shots)
    if project.quality.ringing == "off" or project.quality.mode != "final":
        return shots
    from .ghosts.diffraction_rings import ringing_for

    rings = ringing_for(project.quality.ringing, shots[0].opening, semi, settled.order.f_number)
    return tuple(replace(shot, ringing=rings) for shot in shots)


def _checked(project: Project) -> GhostRanking | None:
    """Check that the picture fits the memory; return an empty ranking if the project asks for a matte."""
    output, size_px = project.output, project.camera.size_px
    refuse_matte_of_reference(project)
    ranks = output.matte_ranks if output.matte == "ghosts" else 0
    # a lower bound: beauty, ghosts and starburst exist in every render
    check_memory(prod(size_px) * (PIXEL_BYTES * (3 if output.starburst else 2) + RANK_BYTES * ranks), spare_bytes())
    return GhostRanking(size_px, ranks) if ranks else None


def refuse_matte_of_reference(project: Project) -> None:
    """Raise ProjectError for a matte of a quality that does not draw each ghost alone."""
    if project.output.matte == "ghosts" and project.quality.mode == "reference":
        raise ProjectError(
            "a matte needs each ghost alone, which reference quality does not draw: choose final quality, or no matte"
        )


def _matte(ranking: GhostRanking, passes: Sequence[Layer], project: Project, art: ResolvedArt) -> GhostMatte:
    """Return the matte of ranked ghosts among the passes, which have their gains."""
    colorspace = project.output.colorspace
    return ghost_matte(ranking, passes, project.camera.size_px, colorspace, art.gain.get("ghosts", 1.0))


def check_finite(layers: Sequence[Layer]) -> None:
    """Raise an error for layers with values that no picture file can hold.

    Raises
    ------
    ProjectError
        A layer has an infinite value or NaN.
    """
    for layer in layers:
        # any infinite value makes both sums infinite; the sum of squares is faster, but may overflow for finite values
        values = layer.pixels.ravel()
        with np.errstate(over="ignore", invalid="ignore"):
            finite = isfinite(np.vdot(values, values)) or isfinite(values.sum(dtype=np.float64))
        if not finite:
            raise ProjectError(
                f"the light of the layer {layer.name} is beyond the numbers that a picture holds (3.4e38): lower the "
                "intensity of the lights or the gains"
            )


def _start_early(work: Callable[[], Layer], threads: int | None) -> Callable[[], Layer]:
    """Start work in a second thread if there is one; return a function that waits for the result.

    The transforms of the starburst hold neither the interpreter lock nor the compiler lock, for which threads that draw
    their first ghosts compete.
    """
    if (threads or os.cpu_count() or 1) < 2:
        return work
    executor = ThreadPoolExecutor(1)
    started = executor.submit(work)
    # do not wait for it when another step raises
    executor.shutdown(wait=False)
    return started.result


@dataclass(frozen=True)
class _Drawn:
    """The ghosts from either renderer: passes that add up, further layers, facts and remarks."""

    passes: tuple[Layer, ...]
    others: tuple[Layer, ...]
    facts: dict[str, Any]
    remarks: tuple[str, ...]
    ledger: Ledger | None = None


@dataclass(frozen=True)
class _Work:
    """How ghosts are drawn, without effect on their light: threads, and what is reported, timed, kept and ranked."""

    threads: int | None
    parts: Mapping[str, Progress | None]
    costs: CostMeter | None
    kept: PartialPicture | None
    ranking: GhostRanking | None


def _ghosts(
    settled: ResolvedProject,
    shots: tuple[Shot, ...],
    art: ResolvedArt,
    work: _Work,
) -> _Drawn:
    project = settled.project
    paths = ghost_paths(settled.lens, project.quality.paths, sensor=settled.sensor is not None)
    singles = project.output.brightest if project.output.layers == "ghosts" else 0
    ghosts = render_ghosts(
        shots, paths, project.quality, singles=singles, art=art.paths, threads=work.threads,
        progress=work.parts["ghosts"], costs=work.costs, kept=work.kept, ranking=work.ranking,
    )  # fmt: skip
    facts = {
        "drawn": ghosts.drawn,
        "dark": ghosts.dark,
        "culled": ghosts.culled,
        "culled_share": ghosts.culled_share,
        "muted": ghosts.muted,
    }
    remarks = []
    if ghosts.culled:
        share = percent(ghosts.culled_share)
        remarks.append(f"{ghosts.culled} ghosts that carry {share} of the ghost light were left out")
    if ghosts.faint:
        facts |= {"faint": ghosts.faint, "faint_share": ghosts.faint_share}
        remarks.append(
            f"{len(project.lights)} lights: {ghosts.faint} ghosts of single lights were left out, which carry "
            f"{percent(ghosts.faint_share)} of the ghost light"
        )
    two = _Drawn((ghosts.total,), ghosts.singles, {"ghosts": facts}, tuple(remarks))
    if project.quality.orders == 2:
        return two
    if project.quality.mode == "draft":
        return replace(two, remarks=(*remarks, "draft quality has no ghosts of four reflections; final quality has"))
    plain = plain_level(shots, paths, work.threads) if art.paths else ghosts.level
    four = _fours(settled, shots, (plain, ghosts.level), singles, work)
    return _Drawn(
        two.passes + four.passes, two.others + four.others, {**two.facts, **four.facts}, two.remarks + four.remarks
    )


def _fours(
    settled: ResolvedProject,
    shots: tuple[Shot, ...],
    levels: tuple[float, float],
    singles: int | None,
    work: _Work,
) -> _Drawn:
    """Draw the four-reflection ghosts above the limit; `levels` of two-reflection ghosts without and with art."""
    from .reference.kept_search import search_kept

    quality = settled.project.quality
    limit = quality.order4_limit
    found = search_kept(
        work.kept, settled.lens, shots, limit, quality.seed, which=quality.paths, threads=work.threads,
        progress=work.parts["search"],
    )  # fmt: skip
    art = resolve_art(settled, found.paths)
    ghosts = render_ghosts(
        shots, found.paths, quality.replace(cull=0.0), singles=singles, art=art.paths, level=levels[1],
        faintest=limit * levels[0], threads=work.threads, progress=work.parts["fours"], costs=work.costs,
        kept=work.kept, ranking=work.ranking,
    )  # fmt: skip
    muted = {name for name, changed in art.paths.items() if not changed.enabled}
    dark, part = found.left_out(muted.union(ghosts.names))
    facts = {
        "drawn": ghosts.drawn,
        "muted": ghosts.muted,
        "left_out": dark,
        "left_out_share": part,
        "share_of_two_reflections": found.share,
    }
    remarks = [
        f"{ghosts.drawn} ghosts of four reflections were drawn; {dark} fainter ones were left out, which carry "
        f"{part:.1%} of that light, {part * found.share:.2%} of the two-reflection light"
    ]
    if found.short:
        remarks.append(f"--order4-limit {limit:g} is so low that some ghosts above it may have been missed")
    return _Drawn(
        (replace(ghosts.total, name="ghosts.order4"),), ghosts.singles, {"ghosts.order4": facts}, tuple(remarks)
    )


def _reference(
    settled: ResolvedProject,
    mask: Floats | None,
    run: ReferenceRun | None,
    threads: int | None,
    progress: Progress | None,
) -> _Drawn:
    from .reference.estimator import ReferenceRun, render_reference

    found = render_reference(settled, mask, run or ReferenceRun(), threads=threads, progress=progress)
    remarks = list(found.remarks)
    if settled.project.output.layers == "ghosts":
        remarks.append("reference quality has no layer for each ghost; final quality has")
    if has_overrides(settled.project):
        remarks.append("reference quality shows the physics: art direction and offsets by chance are left out")
    if settled.project.quality.paths != "all":
        remarks.append(f"reference quality traces every path, not only {settled.project.quality.paths} ones")
    return _Drawn(found.layers, found.variances, {"reference": found.facts}, tuple(remarks), found.ledger)
