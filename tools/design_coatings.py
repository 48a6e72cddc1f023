"""Design the "modern broadband" coating: five films with thicknesses for each index of the glass.

Prints the table of `optics/coatings/presets.py`. For each index of the glass the thicknesses minimise the root mean
square of R at 0, 20 and 35 degrees, because a ghost's light is proportional to R squared; half the weight over
wavelength is uniform between 420 and 680 nm and half follows the eye's sensitivity. Each glass starts from the
thicknesses of the previous one, so that the table is smooth and can be interpolated. Needs SciPy:
`python tools/design_coatings.py`.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from flarewright.optics.coatings.presets import BROADBAND_GLASS, BROADBAND_INDICES
from flarewright.optics.coatings.thin_film import stack_reflectance
from flarewright.optics.colour.cie1931 import cie_1931

WAVELENGTHS_NM = np.linspace(420.0, 680.0, 66)[:, None]
COSINES = np.cos(np.radians([0.0, 20.0, 35.0]))
_EYE = cie_1931(WAVELENGTHS_NM[:, 0])[:, 1]
WEIGHTS = 0.5 / len(WAVELENGTHS_NM) + 0.5 * _EYE / _EYE.sum()
START_AT, START_NM = 1.80, (96.1, 143.7, 36.7, 29.7, 27.5)


def reflectance(glass: float, thicknesses_nm: np.ndarray) -> np.ndarray:
    """Return R, shape (wavelengths, angles)."""
    films = np.maximum(thicknesses_nm, 0.0)
    return stack_reflectance(1.0, glass, BROADBAND_INDICES, films, WAVELENGTHS_NM, COSINES)


def refine(glass: float, start_nm: np.ndarray) -> np.ndarray:
    """Minimise the root mean square of R near a start; films have at least 5 nm."""
    bounds = [(5.0, 300.0)] * len(start_nm)

    def merit(thicknesses_nm: np.ndarray) -> float:
        return 1e4 * float(np.sqrt((WEIGHTS @ reflectance(glass, thicknesses_nm) ** 2).mean()))

    best = minimize(merit, start_nm, method="L-BFGS-B", bounds=bounds)
    best = minimize(merit, best.x, method="Nelder-Mead", bounds=bounds, options={"maxfev": 8000, "xatol": 1e-3})
    return np.asarray(best.x)


def main() -> None:
    """Optimize the glasses from the middle outwards and print the table in tenths of a nanometre."""
    found: dict[float, np.ndarray] = {}
    middle = min(range(len(BROADBAND_GLASS)), key=lambda k: abs(BROADBAND_GLASS[k] - START_AT))
    for walk in (range(middle, len(BROADBAND_GLASS)), range(middle, -1, -1)):
        start = np.array(START_NM)
        for k in walk:
            start = found[BROADBAND_GLASS[k]] = refine(BROADBAND_GLASS[k], start)
    for glass in sorted(found):
        films = np.round(found[glass], 1)
        R = reflectance(glass, films)[:, 0]
        print(f"    {tuple(float(d) for d in films)},  # {glass:.2f}: mean {R.mean():.4%}, most {R.max():.3%}")


if __name__ == "__main__":
    main()
