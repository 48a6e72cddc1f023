"""Design the adapter of `lenses/anamorphic-heliar-2x.toml`: two doublets of cylinders, afocal, in front of the Heliar.

Thin lenses give the start: a front doublet of focal length -F / 2 and a rear one of F, each achromatic. Then least
squares determine the six radii across and the gap between the doublets, so that in the x-z plane the focal length is
half of that along y, both foci coincide, rays at four angles and three wavelengths meet, and the streak is uniform.

Each pair of the four faces between glass and air makes a streak on the line through the light. To first order, light
that enters at the height h across lands at S00 h, so the light per mm of a streak grows as S00 falls. The two faces
that face each other make the wanted streak: it is longer than the picture is wide, and uniform where the five others,
which end within the picture, are much fainter.

Prints the radii, rounded, the gap, the residuals in micrometres before rounding, and for each pair of faces its light
per mm over that of the wanted one and its length at f/8. Needs SciPy: `python tools/design_anamorphic.py`.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq, least_squares

from flarewright.io.lens.media import attach
from flarewright.model import Lens, Surface
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import FirstOrder, first_order, path_matrices
from flarewright.optics.lens.paths import ghost_path
from flarewright.optics.lens.surface_shape import transposed
from flarewright.optics.rays.single_rays import trace_polylines
from flarewright.render.scene.resolve import load_lens

REAR_MM = 100.0
FRONT_MM = -REAR_MM / 2.0
CROWN, FLINT = (attach(name, None, None)[0] for name in ("N-LAK9", "N-SF5"))
THICKNESS = (5.0, 18.0, 4.0, 12.0, 4.0)  # front crown, front flint, rear flint, rear crown, air to the lens
ANGLES = (0.0, 5.0, 10.0, 14.0)
WAVELENGTHS_NM = {587.56: 1.0, 486.1: 0.5, 656.3: 0.5}
PUPIL = np.array([-0.8, -0.4, 0.0, 0.4, 0.8])
PER_MM = 4.0
# pairs of faces between glass and air, that of the wanted streak first
WANTED, OTHERS = (3, 2), ((2, 0), (3, 0), (5, 0), (5, 2), (5, 3))
# weight of the other streaks' light per mm of the sensor
EVEN = 0.3
# the most curved face must pass the beam, whose half width is 23 mm
LEAST_RADIUS_MM = 36.0
BASE = load_lens("heliar-tronnier")
OWN = first_order(BASE)


def adapter(values: np.ndarray) -> Lens:
    """Return adapter and lens for six curvatures across and a gap."""
    *curvatures, gap = map(float, values)
    a, b, c, d, e = THICKNESS
    media = (CROWN, FLINT, None, FLINT, CROWN, None)
    gaps = (a, b, gap, c, d, e)
    rows = [
        Surface(curvature_x=curvature, thickness=thickness, medium=medium)
        for curvature, thickness, medium in zip(curvatures, gaps, media, strict=True)
    ]
    return Lens(name="adapter", f_number=BASE.f_number, rows=(*rows, *BASE.rows))


def start() -> np.ndarray:
    """Return thin achromats: powers P V / (V - V') of crown and flint, bent towards the gap between them."""
    split = CROWN.v_d - FLINT.v_d
    crown, flint = CROWN.v_d / split / (CROWN.n_d - 1.0), -FLINT.v_d / split / (FLINT.n_d - 1.0)
    first = 0.6 * crown / FRONT_MM
    second = first - crown / FRONT_MM
    third = second - flint / FRONT_MM
    last = -0.45 * crown / REAR_MM
    fifth = last + crown / REAR_MM
    return np.array([first, second, third, fifth + flint / REAR_MM, fifth, last, 15.0])


def misses(values: np.ndarray) -> np.ndarray:
    """Return the residuals: focal length, focus, rays relative to their chief ray, and non-uniformity of the streak."""
    lens = adapter(values)
    order = first_order(lens)
    assert order.efl_x is not None
    assert order.bfl_x is not None
    found = [200.0 * (order.efl_x / OWN.efl - 0.5), 5.0 * (order.bfl_x - order.bfl)]
    across = transposed(lens)
    for angle in np.radians(ANGLES):
        y = np.linspace(-90.0, 90.0, 241) if angle else np.linspace(-22.0, 22.0, 61)
        middle = None
        for wavelength_nm, weight in WAVELENGTHS_NM.items():
            hits = trace_polylines(
                across, None, np.zeros_like(y), y, -angle,
                sensor_distance=order.sensor_distance, wavelength_nm=wavelength_nm,
            )  # fmt: skip
            through = np.isfinite(hits[:, -1, 1])
            at_stop, landed = hits[through, 1 + across.stop_row, 1], hits[through, -1, 1]
            rising = np.argsort(at_stop)
            places = np.interp(PUPIL * 0.8 * OWN.stop_semi_diameter, at_stop[rising], landed[rising])
            middle = places[2] if middle is None else middle
            found += list(weight * PER_MM * (places - middle))
    wanted = streak(lens, order, WANTED)[0]
    found += [EVEN * wanted / streak(lens, order, pair)[0] for pair in OTHERS]
    found.append(20.0 * max(0.0, LEAST_RADIUS_MM * np.abs(values[:6]).max() - 1.0))
    return np.array(found)


def streak(lens: Lens, order: FirstOrder, pair: tuple[int, int]) -> tuple[float, float]:
    """Return S00 across of a ghost, and its height on the sensor over that in the stop."""
    sensor_z = sum(row.thickness for row in lens.rows[:-1]) + order.sensor_distance
    (*_, to_stop), total = path_matrices(lens, ghost_path(lens, *pair), D_LINE_NM, sensor_z, across=True)
    return float(total[0, 0]), float(total[0, 0] / to_stop[0, 0])


def _apart(radii: np.ndarray, gap: float) -> float:
    order = first_order(adapter(np.array([*1.0 / radii, gap])))
    assert order.bfl_x is not None
    return order.bfl_x - order.bfl


def main() -> None:
    """Run the design and print the result."""
    scale = np.abs(start())
    solved = least_squares(lambda x: misses(x * scale), start() / scale, diff_step=1e-4, max_nfev=100)
    values = solved.x * scale
    radii = np.round(1.0 / values[:6], 2)
    gap = brentq(lambda gap: _apart(radii, gap), values[6] - 10.0, values[6] + 10.0)
    print("radii across:", *radii, "gap that brings the foci together:", round(gap, 3))
    order = first_order(adapter(np.array([*1.0 / radii, gap])))
    print(f"efl {order.efl:.3f} along y, {order.efl_x:.3f} across")
    weights = np.repeat(np.tile(list(WAVELENGTHS_NM.values()), len(ANGLES)), len(PUPIL)) * PER_MM
    shape = len(ANGLES), len(WAVELENGTHS_NM), len(PUPIL)
    print(np.round(1e3 * solved.fun[2 : 2 + len(weights)] / weights).reshape(shape))
    lens = adapter(np.array([*1.0 / radii, gap]))
    wanted = streak(lens, order, WANTED)[0]
    half = first_order(lens, 8.0).stop_semi_diameter
    for pair in (WANTED, *OTHERS):
        own, height = streak(lens, order, pair)
        print(f"{pair[0]}-{pair[1]}: light per mm {abs(wanted / own):.2f}, length {2.0 * half * abs(height):.1f} mm")


if __name__ == "__main__":
    main()
