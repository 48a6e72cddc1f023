"""Tell ghosts from what halo and star leave around the light.

Both are known to some per cent. What they leave goes with the light and lies all around it, at every constellation the
same: over many of them that is seen as well as a ghost, and is fitted as one. No camera tells a faint disc that never
leaves the light from its halo, or what is fainter still than half a hundredth of the glow from an error of its law.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..kernels.measure_pupil import BELOW, FIRST_G
from .dimmed import AROUND_LIGHT, LEFT_BEHIND, off_light
from .evenly import evenly
from .fit import light_of
from .found import CHANNELS, Found, leading, noise_of
from .numbers import Floats, divided_by, ten_terms
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
    noise = noise_of(views)
    return [_is_glow(ghost, leading(ghost, noise), views) for ghost in ghosts]


def _is_glow(ghost: Found, lead: int, views: Sequence[View]) -> bool:
    off = _off_light(ghost, lead, views)
    if off <= _HIDDEN_OFF and _hidden(ghost, lead, views):
        return True
    part = _part(ghost, views)
    return any(off <= far and part <= most for far, most in _GLOW)


def _seen(ghost: Found, views: Sequence[View]) -> Sequence[View]:
    return views[ghost.first : ghost.last + 1]


def _off_light(ghost: Found, lead: int, views: Sequence[View]) -> float:
    """Return by how much a ghost's middle is off the light at most, part of its size or of the light's way."""
    seen = _seen(ghost, views)
    place, size = _placed(ghost.shapes[lead], np.array([view.sigma for view in seen]))
    light = np.array([_along(view) for view in seen])
    off = np.abs(place - light)
    return float(max((off / np.maximum(size, 1e-9)).max(), off.max() / max(light.max(), 1e-9)))


def _placed(shape: Shape, sigma: Floats) -> tuple[Floats, Floats]:
    """Return place along the light's line and size by a shape's pupil's middle at fields, pixels."""
    none = np.zeros_like(sigma)
    terms = ten_terms(none, none, sigma**2)
    below = divided_by(shape.numbers[BELOW], shape.numbers[BELOW + 1], none, sigma**2)
    place = sigma * (shape.numbers[:10] @ terms) / below
    return place, np.abs(shape.numbers[FIRST_G : FIRST_G + 10] @ terms) / below


def _along(view: View) -> float:
    """Return how far the light is from the axis, pixels."""
    return float(np.hypot(view.light_px[0] - view.frame[0], view.light_px[1] - view.frame[1]))


def _hidden(ghost: Found, lead: int, views: Sequence[View]) -> bool:
    """Tell whether a ghost looks out hardly anywhere from where nothing is looked for."""
    _, size = _placed(ghost.shapes[lead], np.array([view.sigma for view in _seen(ghost, views)]))
    return bool(size.max() <= _HIDDEN * AROUND_LIGHT * views[0].size_px[0] + _COARSE_PX)


def _part(ghost: Found, views: Sequence[View]) -> float:
    """Return which part of all light that is seen at its place, away from the light, is a ghost's; 0 where none is."""
    own, every = 0.0, 0.0
    for view in evenly(_seen(ghost, views), _VIEWS):
        far = off_light(view) > AROUND_LIGHT * view.size_px[0]
        for m in range(CHANNELS):
            part, light = light_of(ghost.shapes[m], view)
            there = far[part] & (light > 0.0) & np.isfinite(view.variance[part][..., m])
            own += float(light[there].sum())
            every += float(view.pixels[part][..., m][there].sum())
    return own / every if every > 0.0 else 0.0
