"""The colours of a path between the traced wavelengths, where coatings bend them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernels.standing import seen_rays, standing_rays
from ..model import Lens
from ..optics.bundle import Bundle
from ..optics.coating_curves import CURVE_NM, bends, mirror_squares_traced, passed
from ..optics.paths import LightPath, direct_path
from .shot import Shot

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

# so many rays of a bundle stand for the angles at which all of it meets the mirrors
RAYS = 12
# and these are looked for among so many triangles of its grid
TRIANGLES = 512

__all__ = ["direct_bend", "direct_flux", "draft_weights", "place_of", "seen_of", "spread_rays", "traced_bend"]


def traced_bend(shot: Shot, path: LightPath, bundle: Bundle, to_pixels: Floats) -> Floats | None:
    """Compare what a ghost's rays carry with straight lines between the traced wavelengths.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    bundle : Bundle
        Traced at one wavelength at least.
    to_pixels : ndarray, shape (4,)
        The shot's, or the ghost's own: coatings reflect by the angle, so what is seen of it counts, if anything is.

    Returns
    -------
    ndarray, shape (L,), or None
        What multiplies the light's spectrum (`Shot.weights`); None where nothing bends, or no ray passes.
    """
    if shot.curves is None:
        return None
    held = sorted(bundle.traced)
    middle = held[len(held) // 2]
    chosen = spread_rays(bundle, (middle,), seen_of(shot, to_pixels), RAYS)
    if chosen.size == 0:
        chosen = spread_rays(bundle, (middle,), _seen(shot, np.zeros((2, 3)), (np.inf, np.inf)), RAYS)
    if chosen.size == 0:
        return None
    squares = mirror_squares_traced(shot.packed, path, shot.incidence.tilt, bundle.pupil[chosen])
    if len(squares) == 0:
        return None
    bend: Floats = bends(passed(shot.curves, [path], squares[None]), shot.packed.wavelengths_nm)[0]
    return bend


def spread_rays(
    bundle: Bundle, waves: Sequence[int], passes: Callable[[Floats], Bools], count: int
) -> NDArray[np.intp]:
    """Choose rays of a bundle that stand for its light.

    Parameters
    ----------
    bundle : Bundle
    waves : sequence of int
        Traced wavelengths at which each of them must pass; of all rays if there are none.
    passes : callable
        Tells which traced rays do.
    count : int

    Returns
    -------
    ndarray of int
        Nodes of the bundle, spread evenly over the pupil's area: a node comes as often as its triangles are large, for
        the grid is fine at rims and folds. Empty where none passes.
    """
    passing = np.ones(len(bundle.pupil), dtype=np.bool_)
    for w in waves:
        passing &= passes(bundle.traced[w])
    step = max(1, len(bundle.triangles) // TRIANGLES)
    chosen: NDArray[np.intp] = standing_rays(bundle.pupil, bundle.triangles, passing, step, count)
    return chosen


def seen_of(shot: Shot, to_pixels: Floats) -> Callable[[Floats], Bools]:
    """Tell which traced rays meet no rim, cross the stop in the circle around the iris, and land in the picture.

    Parameters
    ----------
    shot : Shot
    to_pixels : ndarray, shape (4,)
        The shot's, or a ghost's own.

    Returns
    -------
    callable
        From rays as in `optics.bundle.trace_points`, shape (N, 5 + 2 C), to a mask of shape (N,).
    """
    return _seen(shot, place_of(shot, to_pixels), shot.size_px)


def _seen(shot: Shot, place: Floats, size_px: tuple[float, float]) -> Callable[[Floats], Bools]:
    """Do the same for a picture of any size, infinite too, and places as in `kernels.standing.seen_rays`."""
    iris_radius, width, height = shot.opening.radius, float(size_px[0]), float(size_px[1])

    def seen(rays: Floats) -> Bools:
        mask: Bools = seen_rays(rays, iris_radius, place, width, height)
        return mask

    return seen


def place_of(shot: Shot, to_pixels: Floats) -> Floats:
    """Tell where the meridional frame lies in the picture, as kernels read it.

    Parameters
    ----------
    shot : Shot
    to_pixels : ndarray, shape (4,)
        The shot's, or a ghost's own.

    Returns
    -------
    ndarray, shape (2, 3)
        Column and row of the axis, and how they grow with x and with y, pixels per mm.
    """
    place = np.empty((2, 3))
    # the upright picture is the meridional frame's, turned and upside down
    place[:, 0], place[:, 1:] = to_pixels[:2], (-shot.incidence.axes * [to_pixels[2], -to_pixels[3]]).T
    return place


def direct_bend(shot: Shot, lens: Lens) -> Floats | None:
    """Do the same for light that no surface reflects.

    Parameters
    ----------
    shot : Shot
    lens : Lens

    Returns
    -------
    ndarray, shape (L,), or None
    """
    if shot.curves is None:
        return None
    through = passed(shot.curves, [direct_path(lens)], np.zeros((1, 1, 0)))
    bend: Floats = bends(through, shot.packed.wavelengths_nm)[0]
    return bend


def direct_flux(shot: Shot, lens: Lens, throughputs: Sequence[Floats], fine_nm: Floats) -> Floats:
    """Interpolate the flux of direct lights between the traced wavelengths.

    Parameters
    ----------
    shot : Shot
    lens : Lens
    throughputs : sequence of ndarray, N of shape (W,)
        At the traced wavelengths.
    fine_nm : ndarray, shape (F,)

    Returns
    -------
    ndarray, shape (N, F)
    """
    flux: Floats = np.array([np.interp(fine_nm, shot.packed.wavelengths_nm, one) for one in throughputs])
    bend = direct_bend(shot, lens)
    return flux if bend is None else flux * np.interp(fine_nm, CURVE_NM, bend)


def draft_weights(shot: Shot, paths: Sequence[LightPath], squares: Floats) -> Floats:
    """Return the RGB weights of the traced wavelengths for each of some paths.

    Parameters
    ----------
    shot : Shot
    paths : sequence of LightPath
        Of two reflections each.
    squares : ndarray, shape (P, 2)
        From `kernels.matrix.mirror_squares`.

    Returns
    -------
    ndarray, shape (P, W, 3)
    """
    assert shot.curves is not None, "nothing bends"
    traced_nm = shot.packed.wavelengths_nm
    return shot.weights(traced_nm, bends(passed(shot.curves, paths, squares[:, None]), traced_nm))
