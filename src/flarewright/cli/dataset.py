"""`flarewright dataset`: draw training pairs for the removal and the detection of lens flare."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ProjectError
from .common import check_place, first_run_bar, print_json, print_remark, print_remarks, progress_bar
from .option_record import with_options
from .partial_work import partial_work
from .progress_lines import ProgressLines
from .shared_options import output_option

if TYPE_CHECKING:
    from ..model import Project
    from ..model.project.dataset import DatasetSpec
    from ..workflow.training_pairs.item import ItemResult
    from ..workflow.training_pairs.run import DatasetResult

EPILOG = (
    "Examples:\n\nflarewright dataset --example > pairs.toml\n\n"
    "flarewright dataset pairs.toml --preview sheet.png\n\n"
    "flarewright dataset pairs.toml -n 10000 -o pairs"
)
# items of a contact sheet, unless -n states another number
_PREVIEWED, _MOST_PREVIEWED = 8, 64


@dataclass(frozen=True, kw_only=True)
class DatasetOptions:
    """Options of `flarewright dataset`. None: not given."""

    spec: Annotated[Path | None, typer.Argument(metavar="SPEC.toml", help="The distributions to draw from.")] = None
    output: Annotated[Path | None, output_option(metavar="DIR", help="Folder of the data set.")] = None
    items: Annotated[
        int | None, typer.Option("-n", "--items", min=1, help="Number of items (default: 100; of a preview 8).")
    ] = None
    seed: Annotated[int | None, typer.Option(min=0, help="Seed (default: that of the specification).")] = None
    preview: Annotated[
        Path | None,
        typer.Option(metavar="SHEET.png", help="Write a contact sheet of the first items instead of a data set."),
    ] = None
    example: Annotated[bool, typer.Option("--example", help="Print a specification to start from, and exit.")] = False
    processes: Annotated[int | None, typer.Option(min=1, help="Number of processes (default: one per core).")] = None
    threads: Annotated[
        int | None, typer.Option(min=1, help="Threads of all processes together (default: one per core).")
    ] = None
    chunk: Annotated[
        str | None, typer.Option(metavar="I/N", help="Draw part I of N of the items, for render farms.")
    ] = None
    cluster: Annotated[
        str | None,
        typer.Option(metavar="WHERE", help="Draw on a Dask cluster: local:N, tcp://HOST:PORT or slurm:FILE."),
    ] = None
    as_json: Annotated[bool, typer.Option("--json", help="Print a summary as one JSON object.")] = False


@with_options(DatasetOptions)
def dataset(options: DatasetOptions) -> None:
    """Draw training pairs for the removal and the detection of lens flare, from distributions in a file.

    Finished items are kept: the same command resumes, and a larger -n adds items. On a terminal a bar shows the
    progress; elsewhere stderr gets one line of JSON for each item.
    """
    if options.example:
        _print_example(options)
        return
    if options.spec is None:
        raise ProjectError("a specification is missing; flarewright dataset --example > pairs.toml writes one")
    if (options.output is None) == (options.preview is None):
        what = "--preview and -o are two outputs" if options.output else "there is no output"
        raise ProjectError(f"{what}; give -o FOLDER for a data set, or --preview SHEET.png for a contact sheet")
    settings = _settings(options.spec, options.seed)
    if options.preview is not None:
        _preview(settings, options.preview, options.spec, options)
    elif options.output is not None:
        _draw(settings, options.output, options)


def _print_example(options: DatasetOptions) -> None:
    from ..io.project.file_of_kind import example_file

    idle = _first_given(
        {
            "SPEC.toml": options.spec, "-o": options.output, "-n": options.items, "--seed": options.seed,
            "--preview": options.preview, "--processes": options.processes, "--threads": options.threads,
            "--chunk": options.chunk, "--cluster": options.cluster, "--json": options.as_json or None,
        }
    )  # fmt: skip
    if idle is not None:
        raise ProjectError(f"--example only prints a specification; leave {idle} out")
    sys.stdout.write(example_file("dataset"))


def _first_given(values: dict[str, object]) -> str | None:
    """Return the first flag that has a value."""
    return next((flag for flag, value in values.items() if value is not None), None)


def _settings(path: Path, seed: int | None) -> DatasetSpec:
    from ..io.project.dataset_file import read_dataset_spec

    settings = read_dataset_spec(path)
    if seed is None:
        return settings
    if seed >= 2**63:
        raise ProjectError(f"--seed {seed} is too large; choose one below {2**63}")
    return settings.replace(seed=seed)


def _draw(settings: DatasetSpec, output: Path, options: DatasetOptions) -> None:
    """Draw the data set and print what became of it."""
    from ..workflow.training_pairs.run import dataset as draw

    started = time.monotonic()
    with _progress() as report:
        result = draw(
            settings, output, items=100 if options.items is None else options.items, chunk=options.chunk,
            processes=options.processes, threads=options.threads, cluster=options.cluster, prepare=_compile,
            report=report, announce=print_remark,
        )  # fmt: skip
    seconds = time.monotonic() - started
    print_remarks(result.remarks)
    if options.as_json:
        print_json(_data(result, seconds))
        return
    words = [f"drew {result.drawn} item{'s'[: result.drawn != 1]} in {seconds:.1f} s"] if result.drawn else []
    words += [f"kept {result.kept} that the same specification made"] if result.kept else []
    words += [f"{number} {split}" for split, number in result.splits.items()]
    print_remarks([f"{result.folder}: {', '.join(words) or 'no item was to be drawn'}"])


def _data(result: DatasetResult, seconds: float) -> dict[str, Any]:
    """Return the summary of `--json`."""
    return {
        "folder": result.folder, "items": result.items, "drawn": result.drawn, "kept": result.kept,
        "splits": result.splits, "lenses": result.lenses, "complete": result.complete, "processes": result.processes,
        "seconds": round(seconds, 3), "remarks": list(result.remarks),
    }  # fmt: skip


def _preview(settings: DatasetSpec, preview: Path, spec: Path, options: DatasetOptions) -> None:
    """Write a contact sheet."""
    idle = _first_given({"--chunk": options.chunk, "--processes": options.processes, "--cluster": options.cluster})
    if idle is not None:
        raise ProjectError(f"{idle} has no effect on a contact sheet; leave it out")
    from ..io.images.contact_sheet import Figure
    from ..io.images.png import write_png
    from ..measure.core.checkpoint import recorded
    from ..workflow.training_pairs.background import list_backgrounds
    from ..workflow.training_pairs.draw import draw_item
    from ..workflow.training_pairs.preview import preview_picture
    from ..workflow.training_pairs.run import dataset_digest

    number = _PREVIEWED if options.items is None else options.items
    if number > _MOST_PREVIEWED:
        raise ProjectError(f"a contact sheet has at most {_MOST_PREVIEWED} items; choose a smaller -n than {number}")
    check_place(preview, ".png")
    from ..kernels.jit.warmup_processes import cores

    _compile(draw_item(settings, 0).project, options.threads or cores())
    recorded(Figure)
    # a larger -n draws the same first items
    inputs = ["preview", dataset_digest(settings, list_backgrounds(settings))]
    with partial_work(preview, inputs, "item", "items") as steps, progress_bar() as begin:
        bar = begin("preview")
        sheet = preview_picture(
            settings, number, threads=options.threads, step=steps.step,
            report=lambda done, of: bar(done / of, f"item {done} of {of}"),
        )  # fmt: skip
    write_png(preview, sheet, {"Description": f"first {number} items of {spec.name}"})
    if options.as_json:
        print_json({"preview": str(preview), "items": number})
    else:
        print_remarks([f"wrote {preview}"])


def _compile(project: Project, threads: int) -> None:
    """Compile the kernels of an item, once for all processes."""
    from ..render.warmup import compile_for_render

    compile_for_render(project, threads, print_remark, first_run_bar)


@contextmanager
def _progress() -> Iterator[Callable[[ItemResult, int, int], None]]:
    """Show a bar on a terminal; elsewhere print one JSON object per item to stderr."""
    if sys.stderr.isatty():
        with progress_bar() as begin:
            bar = begin("dataset")
            yield lambda result, done, of: bar(done / of, f"item {result.index}, {done} of {of}")
        return
    lines = ProgressLines()
    yield lambda result, done, of: lines.finished(
        {"item": result.index, "split": result.split}, drawn=result.drawn, done=done, of=of
    )
