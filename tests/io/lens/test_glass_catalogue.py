"""The glass catalogue: complete, fast, found by name and by numbers."""

from __future__ import annotations

import subprocess
import sys
from importlib.resources import files

import numpy as np
import pytest

from flarewright.errors import GlassError
from flarewright.io.lens import glass_catalogue
from flarewright.io.lens.glass_catalogue import all_names, by_name, nearest
from flarewright.optics.lens.dispersion import dispersion_index


def test_size_and_makers():
    assert len(all_names()) >= 1600
    makers = {name.split()[0] for name in all_names()}
    assert makers == {"SCHOTT", "OHARA", "HOYA", "HIKARI", "CDGM", "SUMITA"}
    assert (files("flarewright.io") / "data" / "glasses.json.gz").stat().st_size < 300_000


def test_every_glass_is_sane_over_the_visible():
    wavelength = np.arange(360.0, 831.0, 10.0)
    for name in all_names():
        glass = by_name(name)
        n = dispersion_index(glass.dispersion, wavelength)
        assert np.all(np.diff(n) < 0.0), name
        n_d, n_f, n_c = dispersion_index(glass.dispersion, np.array([587.5618, 486.1327, 656.2725]))
        assert (n_d - 1.0) / (n_f - n_c) == pytest.approx(glass.v_d, abs=2e-3), name
        assert n_d == pytest.approx(glass.n_d, abs=1e-6), name


@pytest.mark.parametrize("spelling", ["N-BK7", "n-bk7", "NBK7", "n bk7", "SCHOTT N-BK7", "schott_nbk7", "BK7"])
def test_spelling_does_not_matter(spelling):
    assert by_name(spelling).full_name == "SCHOTT N-BK7"


@pytest.mark.parametrize(
    ("old", "new"),
    [("LAKN7", "SCHOTT N-LAK7"), ("SF7", "HIKARI SF7"), ("BAK4", "HIKARI BAK4"), ("BSM14", "OHARA BSM14")],
)
def test_old_names_live_on(old, new):
    assert by_name(old).full_name == new


def test_stated_index_chooses_among_makers():
    schott, cdgm = by_name("SCHOTT F2"), by_name("CDGM F2")
    assert by_name("F2").maker == "SCHOTT"
    assert by_name("F2", cdgm.n_d).n_d == pytest.approx(cdgm.n_d)
    assert schott.n_d != cdgm.n_d


def test_unknown_name_suggests_near_ones():
    with pytest.raises(
        GlassError, match=r"glass 'N-BK77' is not in the catalogue: give n_d and v_d instead; near .*N-BK7"
    ):
        by_name("N-BK77")
    with pytest.raises(GlassError, match="OHARA's catalogue"):
        by_name("OHARA F2X")


def test_nearest_by_numbers():
    glass, distance = nearest(1.5168, 64.17)
    assert glass.n_d == pytest.approx(1.5168, abs=2e-5)
    assert distance < 0.1
    assert nearest(1.574, 52.0)[1] > 1.0
    assert nearest(1.617, 38.5)[1] > 1.0


def test_nearest_by_index_alone_is_no_exotic_glass():
    glass, _ = nearest(1.62, None)
    assert 36.0 < glass.v_d < 62.0


def test_importing_the_catalogue_reads_no_file_and_no_scipy():
    code = (
        "import sys; from flarewright.io.lens import glass_catalogue as g; "
        "assert g._catalogue.cache_info().currsize == 0; assert 'scipy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_alias_of_fluorite():
    assert glass_catalogue.by_name("CaF2").n_d == pytest.approx(1.43384, abs=2e-4)
