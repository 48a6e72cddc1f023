"""Tell ghosts from what halo and star leave around the light.

Both are known to some per cent. What they leave goes with the light and lies all around it, at every constellation the
same: over many of them that is seen as well as a ghost, and is fitted as one. No camera tells a faint disc that never
leaves the light from its halo, or what is fainter still than half a hundredth of the glow from an error of its law.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernels.measure_middle import fill_middles
from .dimmed import AROUND_LIGHT, LEFT_BEHIND, masks_of
from .evenly import evenly
from .fit import light_of
from .found import CHANNELS, Found, leading, noise_of
from .numbers import Floats
from .shape import Shape
from .views import View

# up to which part of all light that is seen there it is glow, by how far its middle is off the light at most, part of
# its size and of the light's way: what is fainter is fitted less exactly. Ghosts of lenses that go along with the light
# for some degrees are farther off or brighter
_GLOW = ((0.05, LEFT_BEHIND), (0.12, 0.02), (np.inf, 0.005))
# views that tell how faint it is
_VIEWS = 8
# size up to which it hardly looks out from where nothing is looked for: parts of that, and pixels, for a halo is not
# known more finely; and how far its middle may be off the light
_HIDDEN, _COARSE_PX, _HIDDEN_OFF = 1.5, 4.0, 0.12


def glow_left(ghosts: Sequence[Found], views: Sequence[View]) -> list[bool]:
    """Tell which ghosts are none, but what halo and star leave.

    Parameters
    ----------
    ghosts : sequence of Found
    views : sequence of View
        As photographed, in the same pixels.

    Returns
    -------
    list of bool
        Those that lie around the light wherever they are seen, and are faint beside it or hardly larger than what is
        not looked at around it; and those that are next to nothing of the light at their place.
    """
    noise, masks = noise_of(views), masks_of(views)
    return [_is_glow(ghost, leading(ghost, noise), views, masks) for ghost in ghosts]


def _is_glow(ghost: Found, lead: int, views: Sequence[View], masks: Sequence[NDArray[np.bool_]]) -> bool:
    seen = views[ghost.first : ghost.last + 1]
    place, size = _placed(ghost.shapes[lead], np.array([view.sigma for view in seen]))
    light = np.array([view.off_axis_px for view in seen])
    off = np.abs(place - light)
    # at most, part of its size or of the light's way
    far = max((off / np.maximum(size, 1e-9)).max(), off.max() / max(light.max(), 1e-9))
    hidden = _HIDDEN * AROUND_LIGHT * views[0].size_px[0] + _COARSE_PX
    if far <= _HIDDEN_OFF and size.max() <= hidden:
        return True
    part = _part(ghost, views, masks)
    return any(far <= least and part <= most for least, most in _GLOW)


def _placed(shape: Shape, sigma: Floats) -> tuple[Floats, Floats]:
    """Return place along the light's line and size by a shape's pupil's middle at fields, pixels."""
    middles = np.zeros((3, sigma.size))
    fill_middles(np.tile(shape.numbers, (sigma.size, 1)), sigma, middles)
    return middles[0], np.abs(middles[1])


def _part(ghost: Found, views: Sequence[View], masks: Sequence[NDArray[np.bool_]]) -> float:
    """Return which part of all light that is seen at its place, where ghosts are looked for, is a ghost's; or 0."""
    own, every = 0.0, 0.0
    for k in evenly(range(ghost.first, ghost.last + 1), _VIEWS):
        for m in range(CHANNELS):
            part, light = light_of(ghost.shapes[m], views[k])
            there = masks[k][part] & (light > 0.0)
            own += float(light[there].sum())
            every += float(views[k].pixels[part][..., m][there].sum())
    return own / every if every > 0.0 else 0.0
