"""The `.lens` importer on a faulty collection: correct remarks, or an error with the reason."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import pytest

from flarewright.cli.app import run
from flarewright.errors import LensError
from flarewright.io.lens.formats.dotlens import read_dotlens
from flarewright.io.lens.lens_writer import write_lens
from flarewright.io.lens.toml_lens import read_lens
from flarewright.model import Lens, QuarterWave, Stop
from flarewright.model.lens.raw_lens import LensReading, RawLens
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens_import.patent_repair import repair
from flarewright.render.scene.resolve import load_lens

CORPUS = Path(os.environ.get("FLAREWRIGHT_CORPUS", Path(__file__).parents[5] / "shared" / "lens_corpus"))
FILES = sorted(CORPUS.glob("*.lens")) if CORPUS.is_dir() else []
needs_corpus = pytest.mark.skipif(not FILES, reason=f"no .lens files in {CORPUS} (set FLAREWRIGHT_CORPUS)")

# verdicts from inspection: (beginning of the file name, words of the reason)
REFUSED = [
    ("Arri_35mm", "the table has 1 row and ends inside glass"),
    ("Canon_1.4x_TC", "focal length is negative (-161.52 mm): a tele-converter"),
    ("Canon_2x_TC_(Canon_Extender_EF2X", "focal length is negative (-71.77 mm): a tele-converter"),
    ("Canon_2x_TC_(Canon_Extender_RF2X", "focal length is negative (-133.44 mm): a tele-converter"),
    ("Canon_496mm_CU", "neither a stop nor an f-number: an attachment (a close-up lens)"),
    ("Canon_500mm_mirror", "light runs backwards behind line 16"),
    ("Fujifilm_Front_Concersion", "afocal"),
    ("Nikon_2.0x_TC", "focal length is negative (-79.70 mm): a tele-converter"),
    ("Wide-conversion", "afocal"),
    ("Zeiss_500mm_F4.5_mirror", "light runs backwards behind line 18"),
]

# required remarks, besides those on apertures and coating marks, which every file has
REPORTED = [
    ("Angenieux_28mm", "the focal length is 26.93 mm, not 28 as stated (-3.8 %)"),
    ("Angenieux_28mm", "is +22.01 mm from the paraxial focus (15.61)"),
    ("Angenieux_28mm", "so neither reading fits; using the header's f-number"),
    ("Angenieux_28mm", "contradicts itself in more than one way"),
    ("Leica_28mm", "the focal length is 29.18 mm, not 28 as stated (+4.2 %)"),
    ("Leica_28mm", "line 20: its rim cuts the axial beam: the lens passes f/2.92, not f/2.8"),
    ("Canon_25mm_F1.45", "line 21: a plane in air neither refracts nor reflects"),
    ("Canon_392mm", "line 43: a plane in air neither refracts nor reflects"),
    ("Canon_99mm", "line 25: a plane in air"),
    ("Sigma_29-77mm", "line 28: a plane in air"),
    ("Yongnuo", "line 24: a plane in air"),
    ("Panasonic_103", "line 34: a surface with the same medium on both sides"),
    ("Cosina_Voigtlander_100mm_F4.5_(Cosina_Viogt", "no V_d is given for n_d = 1.61294"),
    ("Zeiss_60mm", "the file name says f/2.8, the header f/5.6"),
    ("Nikon_180-400mm", "the file name says f/4, the header f/5.7"),
    ("Canon_294mm", "no catalogue glass is near n_d = 1.63555, V_d = 22.7"),
]

# lenses with aspheres or a diffractive surface (by name, resin layer, or an axial image that spheres alone cannot
# give); all others are spherical
ASPHERIC = [
    "Canon_17-39mm",
    "Canon_22mm",
    "Canon_25mm_F1.45",
    "Canon_25mm_F1.85",
    "Canon_26mm",
    "Canon_294mm",
    "Fujifilm_102-203mm",
    "Fujifilm_22mm",
    "Panasonic_103-388mm",
    "Panasonic_12-58mm",
    "Panasonic_26mm",
    "Samyang_19mm",
    "Sigma_16mm",
    "Sigma_19-120mm",
    "Sigma_29-77mm",
    "Sigma_49mm",
    "SongRaw_50mm",
    "Sony_16-78mm",
    "Sony_20mm",
    "Sony_25-68mm",
    "Yongnuo_40mm",
]


def corpus_file(beginning: str) -> Path:
    (found,) = [path for path in FILES if path.name.startswith(beginning)]
    return found


@cache
def imported(path: Path) -> LensReading | None:
    try:
        raw = read_lens(path)
        assert isinstance(raw, RawLens)
        return repair(raw)
    except LensError:
        return None


@needs_corpus
def test_the_collection_is_whole_and_the_rest_is_imported():
    assert len(FILES) == 60
    refused = [path.name for path in FILES if imported(path) is None]
    assert len(refused) == len(REFUSED)


@needs_corpus
@pytest.mark.parametrize(("beginning", "words"), REFUSED)
def test_what_is_no_lens_is_refused_with_the_true_reason(beginning, words):
    path = corpus_file(beginning)
    with pytest.raises(LensError) as caught:
        repair(read_dotlens(path))
    assert words in str(caught.value)
    assert path.name in str(caught.value)


@needs_corpus
@pytest.mark.parametrize(("beginning", "words"), REPORTED)
def test_faults_are_told(beginning, words):
    assert any(words in remark for remark in imported(corpus_file(beginning)).remarks)


@needs_corpus
@pytest.mark.parametrize("files", [FILES[::3], pytest.param(FILES, marks=pytest.mark.slow)], ids=["a third", "all"])
def test_an_imported_lens_is_written_and_read_back(files, tmp_path):
    written = tmp_path / "lens.toml"
    for path in files:
        if (reading := imported(path)) is not None:
            write_lens(reading[0], written)
            assert read_lens(written).lens == reading[0], path.name


@needs_corpus
def test_true_remarks_on_every_imported_file():
    for path in FILES:
        reading = imported(path)
        if reading is None:
            continue
        lens, remarks = reading
        raw = read_dotlens(path)
        text = "\n".join(remarks)
        assert "coating marks dropped" in text, path.name
        assert "the aperture column is read as diameters" in text, path.name
        assert ("aspheric (or diffractive) terms were dropped" in text) == any(map(path.name.startswith, ASPHERIC)), (
            path.name
        )

        # half the stop column is the stop of the stated f-number within the header's rounding
        order = first_order(lens)
        column = next(row.aperture for row in raw.rows if row.stop)
        if not path.name.startswith("Angenieux"):
            assert column / 2.0 == pytest.approx(order.stop_semi_diameter, rel=0.14), path.name
            assert order.efl == pytest.approx(raw.focal_length, rel=0.045), path.name
        assert lens.f_number == raw.f_number
        assert lens.sensor_distance is None


TRIPLET = """\
# Some Triplet 100mm f/2.7
#
# Patent: US002453260
# 7 surfaces, 3 glass elements, f/2.7

name: Some Triplet
focal_length: 99.0

surfaces:
  40.94    8.74   1.61700  55.00   18.500   1
  0        11.05  1.00000  0.00    18.500   0
  -55.65   2.78   1.64900  33.80   14.000   1
  39.75    2.50   1.00000  0.00    14.000   0
  stop     5.13   1.00000  0.00    14.000   0
  107.56   9.54   1.61700  55.00   15.000   1
  -43.33   79.34  1.00000  0.00    15.000   0
"""


def small(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "triplet.lens"
    path.write_text(text, encoding="utf-8")
    return path


def read_small(tmp_path: Path, old: str = "", new: str = "", **options: str) -> LensReading:
    assert old in TRIPLET
    text = TRIPLET.replace(old, new, 1).replace(
        "7 surfaces", f"{TRIPLET.replace(old, new, 1).count(chr(10)) - 9} surfaces"
    )
    return repair(read_dotlens(small(tmp_path, text)), **options)


def test_semi_diameters_are_recognised_and_can_be_overridden(tmp_path):
    lens, remarks = read_small(tmp_path)
    assert any("read as semi-diameters" in remark for remark in remarks)
    assert lens.rows[0].semi_diameter == 18.5
    lens, remarks = read_small(tmp_path, apertures="diameters")
    assert lens.rows[0].semi_diameter == 9.25
    assert any("read as diameters, as requested" in remark for remark in remarks)


def test_whoever_knows_better_says_what_the_column_holds(tmp_path, capsys):
    file, out = str(small(tmp_path, TRIPLET)), tmp_path / "triplet.toml"
    assert run(["lens", "convert", file, str(out), "--apertures", "diameters"]) == 0
    assert "read as diameters, as requested" in capsys.readouterr().err
    assert load_lens(out).rows[0].semi_diameter == 9.25
    assert run(["lens", "check", file, "--apertures", "radii"]) == 2
    assert "choose diameters or semi-diameters" in capsys.readouterr().err
    # lenses of the library have no such column
    assert run(["lens", "check", "heliar-tronnier", "--apertures", "diameters"]) == 2
    assert "leave --apertures out" in capsys.readouterr().err


def test_a_name_cut_short_is_completed(tmp_path):
    lens, remarks = read_small(tmp_path)
    assert lens.name == "Some Triplet 100mm f/2.7"
    assert "the name 'Some Triplet' is cut short; using 'Some Triplet 100mm f/2.7'" in remarks
    assert lens.source.startswith("patent US002453260")


@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("Some_100mm_F1.9.lens", "f/1.9"),
        ("some triplet f1.9.lens", "f/1.9"),
        ("some-f-1,9_late.lens", "f/1.9"),
        ("Some_(Maker's_f1.9).lens", "f/1.9"),
        ("Some_100mm_F2.8D.lens", None),
        ("Some_f100mm.lens", None),
        ("Some_f35mm.lens", None),
        ("Some_AF1.9.lens", None),
        ("Some_F2.7_(Maker's_f1.9).lens", None),
    ],
)
def test_another_f_number_in_the_files_name_is_told(tmp_path, file, said):
    (tmp_path / file).write_text(TRIPLET)
    lens, remarks = repair(read_dotlens(tmp_path / file))
    assert lens.f_number == 2.7
    reported = [remark for remark in remarks if "the file name says" in remark]
    assert reported == ([] if said is None else [f"the file name says {said}, the header f/2.7; using the header's"])


def test_honest_coating_marks_become_quarter_waves(tmp_path):
    text = TRIPLET.replace("   0\n", "   1\n")
    lens, remarks = repair(read_dotlens(small(tmp_path, text)))
    assert all(row.coating == QuarterWave(center_wavelength_nm=550) for row in lens.rows if not isinstance(row, Stop))
    assert any("using a quarter wave at 550 nm" in remark for remark in remarks)


def test_missing_f_number_follows_from_the_stop(tmp_path):
    lens, remarks = read_small(tmp_path, "elements, f/2.7", "elements")
    assert lens.f_number == pytest.approx(5.4, abs=0.05)
    assert any("no f-number is stated" in remark for remark in remarks)


def test_missing_rims_are_left_to_be_estimated(tmp_path):
    lens, remarks = read_small(tmp_path, "18.500   1", "0        1")
    assert lens.rows[0].semi_diameter is None
    assert "line 10: no aperture is given; using an estimate" in remarks


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "  stop     5.13   1.00000  0.00    14.000   0\n",
            "",
            "no row is the stop, and its position is unknown",
        ),
        ("  107.56   9.54", "  stop     9.54", "are all stops"),
        ("  -43.33   79.34  1.00000  0.00    15.000   0\n", "", "ends inside glass"),
        ("  0        11.05  1.00000  0.00 ", "  stop     11.05  1.00000  0.00 ", "are all stops"),
        ("  39.75    2.50   1.00000  0.00    14.000   0\n", "", "the stop stands inside glass"),
        ("14.000   1", "1e-9     1", "line 12: its aperture lets no light through"),
        ("11.05", "-11.05", "light runs backwards behind line 11"),
    ],
)
def test_damage_is_refused_with_the_reason(tmp_path, old, new, words):
    with pytest.raises(LensError, match=words):
        read_small(tmp_path, old, new)


def test_a_wrong_focal_length_is_told_once(tmp_path):
    remarks: list[str] = []
    lens = load_lens(small(tmp_path, TRIPLET.replace("focal_length: 99.0", "focal_length: 90.0")), remarks=remarks)
    assert [remark for remark in remarks if remark.startswith("the focal length")] == [
        "the focal length is 100.00 mm, not 90 as stated (+11.1 %)"
    ]
    # remarks of the import appear when the file is read
    write_lens(lens, tmp_path / "triplet.toml")
    again: list[str] = []
    load_lens(tmp_path / "triplet.toml", remarks=again)
    assert "the focal length is 100.00 mm, the file says 90 mm" in again


def test_rows_that_are_missing_are_noticed(tmp_path):
    with pytest.raises(LensError, match="the header counts 8 surfaces, the table has 7"):
        repair(read_dotlens(small(tmp_path, TRIPLET.replace("7 surfaces", "8 surfaces"))))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("surfaces:\n", "", 'there is no line "surfaces:"'),
        ("40.94 ", "forty ", "line 11: radius is 'forty', a number was expected"),
        ("40.94 ", "1e-99 ", "line 11: radius is 1e-99: less than a micrometre is no lens surface"),
        ("8.74 ", "nan ", "line 11: thickness is 'nan', a number was expected"),
        ("8.74 ", "1e9 ", "line 11: thickness is 1e+09: it must be at most 10000"),
        ("1.61700", "0.61700", "line 11: index is 0.617: a glass lies between 1 and 4.5"),
        ("18.500   1", "-18.500   1", "line 11: aperture is -18.5: it must lie between 0 and 2000 mm"),
        ("55.00   18.500   1", "55.00", "line 11: 4 columns, 6 were expected"),
        ("focal_length: 99.0", "focal_length: long", "line 7: focal_length is 'long', a number in mm was expected"),
    ],
)
def test_broken_tables_are_told_with_their_line(tmp_path, old, new, words):
    # the comment and the empty lines count: the first row is line 10
    words = words.replace("line 11", "line 10")
    with pytest.raises(LensError) as caught:
        read_dotlens(small(tmp_path, TRIPLET.replace(old, new, 1)))
    assert words in str(caught.value)


def test_several_broken_rows_are_all_told(tmp_path):
    with pytest.raises(LensError) as caught:
        read_dotlens(small(tmp_path, TRIPLET.replace("40.94", "x").replace("39.75", "y")))
    assert len(caught.value.problems) == 2


def test_a_table_alone_is_no_lens(tmp_path):
    for text, words in [("surfaces:\n", "is empty"), ("\xff", "no line"), (" ", "is empty")]:
        with pytest.raises(LensError, match=words):
            read_dotlens(small(tmp_path, text))


def test_a_table_without_glass_is_refused(tmp_path):
    text = TRIPLET.replace("1.61700", "1.00000").replace("1.64900", "1.00000")
    with pytest.raises(LensError, match="no row has glass behind it"):
        repair(read_dotlens(small(tmp_path, text)))


def test_a_repaired_lens_is_a_lens(tmp_path):
    assert isinstance(read_small(tmp_path).lens, Lens)
