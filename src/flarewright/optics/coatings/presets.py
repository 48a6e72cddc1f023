"""Standard coatings of four eras: film stacks of real materials for a glass surface in air.

Makers do not publish their stacks. These are the textbook designs of their time, with the indices of evaporated films
near 550 nm; the index of a film is the same at every wavelength.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model.lens.coating import Film, StandardName

MGF2, SIO2, AL2O3, ZRO2 = 1.38, 1.46, 1.63, 2.05
"""Typical indices of evaporated films near 550 nm (Macleod, Thin-Film Optical Filters, table of materials); processes
shift them by a few hundredths. Ta2O5 can replace ZrO2."""

SINGLE_NM = 550.0
MULTI_NM = 530.0

# largest glass index at which the third film of the early multicoating helps; R with and without it is equal there
THIRD_FILM_UP_TO = 1.63

BROADBAND_INDICES = (MGF2, ZRO2, SIO2, ZRO2, SIO2)
BROADBAND_GLASS = tuple(round(1.40 + 0.05 * k, 2) for k in range(16))
# thicknesses in nm from the air to the glass, one row per index above; tools/design_coatings.py computes them
_BROADBAND_NM = (
    (98.4, 130.5, 37.4, 10.1, 60.3),  # 1.40
    (99.1, 133.8, 41.6, 12.3, 59.0),  # 1.45
    (99.6, 136.3, 42.6, 14.8, 40.6),  # 1.50
    (99.9, 138.5, 42.8, 17.4, 39.7),  # 1.55
    (100.2, 140.3, 42.1, 20.0, 37.1),  # 1.60
    (100.4, 141.9, 41.1, 22.7, 34.5),  # 1.65
    (100.6, 143.3, 39.8, 25.3, 32.1),  # 1.70
    (100.7, 144.5, 38.4, 28.0, 29.8),  # 1.75
    (100.7, 145.7, 36.9, 30.7, 27.7),  # 1.80
    (100.8, 146.7, 35.4, 33.5, 25.7),  # 1.85
    (100.8, 147.5, 33.8, 36.4, 23.7),  # 1.90
    (100.8, 148.3, 32.3, 39.4, 21.7),  # 1.95
    (100.7, 149.0, 30.8, 42.5, 19.8),  # 2.00
    (100.7, 149.5, 29.2, 45.8, 17.9),  # 2.05
    (100.6, 149.9, 27.8, 49.3, 15.9),  # 2.10
    (100.6, 150.2, 26.4, 53.2, 13.9),  # 2.15
)


@dataclass(frozen=True)
class StandardCoating:
    """Description and source of a standard coating.

    Attributes
    ----------
    name : str
    era, design, source : str
        Time of use; films from the air to the glass; publication of the design.
    """

    name: StandardName
    era: str
    design: str
    source: str


STANDARD_COATINGS = (
    StandardCoating(
        "uncoated-1930s",
        "before about 1940",
        "bare glass",
        "Fresnel's equations; A. Smakula's patent for Zeiss, applied for in 1935, began the next era",
    ),
    StandardCoating(
        "single-1950s",
        "1940s to 1960s",
        "MgF2, a quarter of 550 nm, the same on every glass",
        "J. Strong, J. Opt. Soc. Am. 26, 73 (1936): evaporated fluoride; magnesium fluoride became the rule",
    ),
    StandardCoating(
        "early-multicoat",
        "1970s",
        "quarter, half, quarter of 530 nm, MgF2, ZrO2, Al2O3; on glass above 1.63 without the third film",
        "L. B. Lockhart and P. King, J. Opt. Soc. Am. 37, 689 (1947); J. T. Cox, G. Hass and A. Thelen, ibid. 52, 965 "
        "(1962)",
    ),
    StandardCoating(
        "modern-broadband",
        "since about 1990",
        "five films, MgF2, ZrO2, SiO2, ZrO2, SiO2, with thicknesses for the index of the glass",
        "a quarter wave over a half wave over thin films that match the glass, the idea of US 3,858,965 (1975) and "
        "US 4,387,960 (1983); our own thicknesses, optimised by tools/design_coatings.py",
    ),
)


def standard_films(name: StandardName, glass: float) -> tuple[Film, ...]:
    """Return the films of a standard coating on one glass.

    Parameters
    ----------
    name : {"uncoated-1930s", "single-1950s", "early-multicoat", "modern-broadband"}
    glass : float
        n_d of the medium that carries the films, the denser side of the surface.

    Returns
    -------
    tuple of Film
        From the air to the glass; empty for bare glass.

    Notes
    -----
    Early multicoating: at its centre wavelength the half-wave film has no effect. Quarter waves n1 and n3 on glass n
    reflect nothing when n3 = n1 sqrt(n), which suits crown glass; n1 alone reflects nothing when n1 = sqrt(n), which
    suits dense flint (Macleod, Thin-Film Optical Filters, chapter 4). Modern: thicknesses are linear between designs
    for indices 0.05 apart, from 1.40 to 2.15, and constant beyond.
    tests/optics/coatings/test_presets.py tests mean R over 420 to 680 nm.
    """
    if name == "uncoated-1930s":
        return ()
    if name == "single-1950s":
        return (Film(index=MGF2, thickness_nm=SINGLE_NM / (4.0 * MGF2)),)
    if name == "early-multicoat":
        quarters = ((MGF2, 1.0), (ZRO2, 2.0), (AL2O3, 1.0))[: 3 if glass <= THIRD_FILM_UP_TO else 2]
        return tuple(Film(index=n, thickness_nm=count * MULTI_NM / (4.0 * n)) for n, count in quarters)
    thicknesses_nm = (float(np.interp(glass, BROADBAND_GLASS, column)) for column in np.transpose(_BROADBAND_NM))
    return tuple(Film(index=n, thickness_nm=d) for n, d in zip(BROADBAND_INDICES, thicknesses_nm, strict=True))
