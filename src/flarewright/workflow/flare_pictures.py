"""Draw the pictures of a prediction by processes of this machine, or on a cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from ..errors import FlarewrightError
from ..jobs.cluster.choice import MOST_WORKERS
from ..jobs.cluster.executor import open_cluster, workers_of
from ..jobs.processes import shares, work_off

if TYPE_CHECKING:
    from ..jobs.cluster.executor import Cluster
    from ..predict.flare import Flare
    from ..predict.pictures import PictureRequest, Spread
    from ..typing import Pixels

_DRAW = "flarewright.workflow.flare_pictures:draw_picture"
# flares that a process keeps; one with its lens takes some megabytes
_MOST_FLARES = 64
# by fingerprint
_flares: dict[str, Flare] = {}

Recipe = tuple[str, "Callable[[int | None], Flare]"]
"""Fingerprint of a flare, and what makes it again."""


@dataclass(frozen=True)
class _Picture:
    """A picture to draw; `flare` is its place among the recipes."""

    number: int
    flare: int
    constellation_deg: float
    roll_deg: float
    colored: bool

    def __str__(self) -> str:
        return f"{self.number + 1}, at {self.constellation_deg:g} degrees"


@contextmanager
def pictures_elsewhere(
    cluster: str | None,
    processes: int | None,
    threads: int | None,
    folder: str | os.PathLike[str],
    announce: Callable[[str], None] | None = None,
) -> Iterator[Spread | None]:
    """Open what draws the pictures of predictions inside the block; they do not depend on it.

    Parameters
    ----------
    cluster : str or None
        Workers of a Dask cluster: "local:4", "tcp://HOST:PORT" or "slurm:FILE" (docs/many-machines.md). None:
        processes of this machine.
    processes : int or None
        None: without a cluster one, this one; with a local one, one per core.
    threads : int or None
        Of all processes together; None: the cores.
    folder : path
        Folder of the results; all workers must see it.
    announce : callable, optional
        Called with sentences about the cluster as they arise.

    Yields
    ------
    Spread or None
        None: each picture is drawn in this process.

    Raises
    ------
    FlarewrightError
        There is no such cluster.

    Examples
    --------
    >>> from flarewright.predict.occurrence import Wanted, predict_occurrence
    >>> with pictures_elsewhere("local:4", None, None, ".") as spread:                  # doctest: +SKIP
    ...     predict_occurrence(flares, Wanted(), lambda _: lambda *_: None, spread=spread)
    """
    number = workers_of(cluster, processes, threads)
    if cluster is None and number in (None, 1):
        yield None
        return
    with open_cluster(cluster, folder, announce) as executor:
        yield partial(_spread, executor, number, threads)


def _spread(
    executor: Cluster | None, processes: int | None, threads: int | None, requests: Sequence[PictureRequest]
) -> Generator[tuple[PictureRequest, Pixels], None, None]:
    recipes: dict[str, tuple[int, Recipe]] = {}
    items = []
    for number, request in enumerate(requests):
        name, recipe = request.flare.fingerprint, request.flare.recipe
        if recipe is None:
            # another process cannot make it
            yield request, request.draw()
            continue
        place, _ = recipes.setdefault(name, (len(recipes), (name, recipe)))
        items.append(_Picture(number, place, *request.at, request.colored))
    # each process keeps its number of threads over all lists, whatever their length
    most, each = shares(MOST_WORKERS, processes, threads)
    number = max(1, min(most, len(items)))
    context = tuple(one for _, one in recipes.values())
    for done in work_off(_DRAW, context, items, processes=number, threads=each, what="picture", executor=executor):
        yield requests[done.item.number], done.result


def draw_picture(context: Sequence[Recipe], item: _Picture, threads: int | None) -> Pixels:
    """Draw a picture in a process that works off a list.

    Returns
    -------
    ndarray, shape (H, W) or (H, W, 3)

    Raises
    ------
    FlarewrightError
        This process reads other files than the caller.
    """
    from ..predict.pictures import PictureRequest

    fingerprint, recipe = context[item.flare]
    if fingerprint not in _flares:
        flare = recipe(threads)
        if flare.fingerprint != fingerprint:
            raise FlarewrightError(
                f"a worker reads another {flare.name} than this command; give all machines the same files"
            )
        if len(_flares) >= _MOST_FLARES:
            _flares.clear()
        _flares[fingerprint] = flare
    return PictureRequest(_flares[fingerprint], item.constellation_deg, item.roll_deg, item.colored).draw()
