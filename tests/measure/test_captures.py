"""Lists of captures: columns, rules, EXIF, and every mistake in a sentence."""

import numpy as np
import pytest
from camera_raw import write_dng

from flarewright.cli.app import run
from flarewright.errors import FlarewrightError
from flarewright.io.captures import AngleRule, parse_rule, read_camera, read_captures

HEAD = "file,constellation_deg,exposure_s,iso,f_number\n"


@pytest.fixture
def folder(tmp_path):
    for k in range(6):
        np.save(tmp_path / f"{k}.npy", np.zeros((2, 2, 3), np.uint16))
    return tmp_path


def listed(folder, text, rule=None):
    (folder / "captures.csv").write_text(text)
    return read_captures(folder / "captures.csv", rule)


def test_a_list_is_read_with_all_its_columns(folder):
    text = "file; exposure_s ;iso;f_number;constellation_deg;roll_deg;focal_mm;light_x_px;light_y_px;kind\n" \
           "0.npy;0.5;200;5.6;3;90;24;10.5;20;\n\n1.npy;0.5;200;;;;;;;dark\n"  # fmt: skip
    light, dark = listed(folder, text)
    assert (light.file, light.exposure_s, light.iso, light.f_number, light.constellation_deg) == (
        "0.npy",
        0.5,
        200,
        5.6,
        3,
    )
    assert (light.roll_deg, light.focal_mm, light.light_x_px, light.light_y_px, light.kind) == (
        90,
        24,
        10.5,
        20,
        "light",
    )
    assert dark.kind == "dark"
    assert dark.constellation_deg is None


def test_a_rule_numbers_the_angles_when_an_exposure_comes_again(folder):
    text = "file,exposure_s,iso,f_number\n" + "".join(f"{k}.npy,{(1, 4)[k % 2]},100,8\n" for k in range(6))
    found = listed(folder, text, AngleRule(1.0, 0.2))
    assert [one.constellation_deg for one in found] == pytest.approx([1.0, 1.0, 1.2, 1.2, 1.4, 1.4])


def test_a_folder_of_raw_files_tells_its_exposures_itself(tmp_path):
    for k in range(4):
        write_dng(tmp_path / f"IMG_{k}.dng", np.full((4, 4), 600, np.uint16), exposure=(1, (8, 2)[k % 2]))
    found = read_captures(tmp_path, parse_rule("10-0.5"))
    assert [(one.constellation_deg, one.exposure_s) for one in found] == [
        (10.0, 0.125), (10.0, 0.5), (9.5, 0.125), (9.5, 0.5)
    ]  # fmt: skip
    assert {(one.iso, one.f_number, one.focal_mm) for one in found} == {(200.0, 2.8, 50.0)}
    with pytest.raises(FlarewrightError, match="--angles"):
        read_captures(tmp_path)


def test_raw_files_tell_their_focal_length_though_a_list_tells_the_rest(tmp_path):
    write_dng(tmp_path / "a.dng", np.full((4, 4), 600, np.uint16), exposure=(1, 8))
    (tmp_path / "b.dng").write_bytes(b"damaged")
    row = "{}.dng,{},1,100,8{}\n"
    head = "file,constellation_deg,exposure_s,iso,f_number{}\n"
    (tmp_path / "list.csv").write_text(head.format("") + row.format("a", 1, ""))
    (found,) = read_captures(tmp_path / "list.csv")
    assert (found.exposure_s, found.iso, found.f_number, found.focal_mm) == (1.0, 100.0, 8.0, 50.0)
    (tmp_path / "list.csv").write_text(head.format(",focal_mm") + row.format("a", 1, ",35"))
    assert read_captures(tmp_path / "list.csv")[0].focal_mm == 35.0
    # merging tells of a damaged one
    (tmp_path / "list.csv").write_text(head.format("") + row.format("b", 1, ""))
    assert read_captures(tmp_path / "list.csv")[0].focal_mm is None


@pytest.mark.parametrize(("text", "rule"), [("0+0.2", (0, 0.2)), ("-5 + .5", (-5, 0.5)), ("30-1", (30, -1))])
def test_rules_are_start_and_step(text, rule):
    assert parse_rule(text) == AngleRule(*rule)


@pytest.mark.parametrize("text", ["", "3", "a+b", "1+0", "1++2", "nan+1", "0+1e3x"])
def test_what_is_no_rule_is_told(text):
    with pytest.raises(FlarewrightError, match="rule"):
        parse_rule(text)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "is empty"),
        (HEAD, "no captures below"),
        ("file,angle\n", "'angle' is unknown"),
        ("exposure_s\n1\n", "no column 'file'"),
        (HEAD + "0.npy,0,1,100\n9.npy,1,1,100,8\n", "9.npy does not exist"),
        (HEAD + "0.npy,0,-1,100,8\n", "line 2: exposure_s"),
        (HEAD + "0.npy,0,1,100,8\n0.npy,1,1,100,8\n", "listed twice"),
        (HEAD + "0.npy,0,,100,8\n", "0.npy in line 2 does not tell its exposure_s"),
        (HEAD + "0.npy,,1,100,8\n", "constellation_deg is missing"),
        (HEAD + "0.npy,0,1,100,8\n1.npy,2,1,100,8\n2.npy,1,1,100,8\n", "out of order: 1 deg follows 2 deg"),
        (HEAD + "0.npy,0,1,100,8\n1.npy,0,2,100,8\n2.npy,1,1,100,8\n", "1 deg lacks the exposure of 2 s"),
        (HEAD + "0.npy,0,1,100,8,,\n", "more cells"),
        ("file,exposure_s,kind\n0.npy,1,dark\n", "no capture of kind light"),
        ("file,exposure_s,exposure_s\n0.npy,1,2\n", "column 'exposure_s' is named twice"),
        (HEAD + "0.npy,0,1,100,8\n1.npy,90,1,100,8\n", "line 3: constellation_deg should be less than 90, not '90'"),
        (HEAD + "0.npy,0,1,100,8\n1.npy,-95,1,100,8\n", "line 3: constellation_deg should be greater than -90"),
        (HEAD + "0.npy,0,1,100,8\n1.npy,1,1,100,5.6\n", "0.npy was taken at f/8 and 1.npy at f/5.6"),
        (HEAD + "0.npy,0,1,100,\n1.npy,0,2,100,8\n2.npy,1,1,100,8\n3.npy,1,2,100,4\n", "1.npy .* f/8 and 3.npy at f/4"),
        (
            "file,constellation_deg,exposure_s,focal_mm\n0.npy,0,1,24\n1.npy,1,1,70\n",
            "0.npy was taken at 24 mm and 1.npy at 70 mm",
        ),
    ],
)
def test_mistakes_are_told_with_their_place(folder, text, word):
    with pytest.raises(FlarewrightError, match=word):
        listed(folder, text)


def test_one_mistake_is_told_once(folder):
    with pytest.raises(FlarewrightError) as told:
        listed(folder, "file,constellation_deg\n0.npy,\n9.npy,0\n1.npy,1\n")
    assert [line.partition(";")[0] for line in told.value.problems] == [
        f"line 3: {folder / '9.npy'} does not exist: check the path and the spelling",
        "2 of 3 photographs do not tell their exposure_s, the first is 0.npy in line 2",
    ]


def test_a_folder_whose_files_tell_no_exposure_is_one_sentence(folder, capsys):
    count = len(list(folder.glob("*.npy")))
    assert run(["measure", "merge", str(folder), "--angles", "0+1", "-o", str(folder / "run")]) == 2
    assert capsys.readouterr().err == (
        f"flarewright: error: {folder}: {count} of {count} photographs do not tell their exposure_s, the first is "
        "0.npy; list them in a captures.csv with file and exposure_s\n"
    )
    for path in folder.glob("*.npy"):
        path.rename(path.with_suffix(".dng"))
    assert run(["measure", "merge", str(folder), "--angles", "0+1", "-o", str(folder / "run")]) == 2
    # damaged ones are told one by one, each named once
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == count + 1
    assert all(line.count(".dng") == 1 for line in lines)


def test_an_f_number_may_be_unknown_or_rounded(folder):
    found = listed(folder, HEAD + "0.npy,0,1,100,\n1.npy,1,1,100,5.6\n2.npy,2,1,100,5.66\n")
    assert [one.f_number for one in found] == [None, 5.6, 5.66]


def test_angles_are_told_once(folder):
    with pytest.raises(FlarewrightError, match=r"tells constellation_deg of 1\.npy, and so does the rule 0\+0\.5"):
        listed(folder, HEAD + "0.npy,,1,100,8\n1.npy,7,1,100,8\n", AngleRule(0.0, 0.5))


def test_the_camera_file_is_checked(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text('{"black_level": 512, "electrons_per_unit": 2.5, "read_noise": 3}')
    assert read_camera(path).electrons_per_unit == 2.5
    path.write_text('{"luminance_cd_m2": 2e6, "solid_angle_sr": 1e-5}')
    assert (read_camera(path).luminance_cd_m2, read_camera(path).solid_angle_sr) == (2e6, 1e-5)
    path.write_text('{"luminance_cd_m2": 2e6, "solid_angle_sr": 6.283}')
    assert read_camera(path).solid_angle_sr == 6.283
    for text, word in (
        ("{", "not JSON"),
        ('{"gain": 1}', "gain"),
        ('{"electrons_per_unit": -1}', "electrons_per_unit"),
        ('{"black_level": 512, "white_level": 511}', "white_level 511 is not above black_level 512"),
        ('{"luminance_cd_m2": 2e6}', "luminance_cd_m2 and solid_angle_sr of the light go together; give both or none"),
        ('{"luminance_cd_m2": 0, "solid_angle_sr": 1e-5}', "luminance_cd_m2"),
        ('{"luminance_cd_m2": 2e6, "solid_angle_sr": 1e999}', "solid_angle_sr"),
        ('{"luminance_cd_m2": 2e6, "solid_angle_sr": 6.284}', "solid_angle_sr: 6.284 is more than a light in front"),
    ):
        path.write_text(text)
        with pytest.raises(FlarewrightError, match=word):
            read_camera(path)
