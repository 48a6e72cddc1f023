"""Lists of captures: columns, rules, EXIF, and one sentence for every error."""

import numpy as np
import pytest
from camera_raw import write_dng

from flarewright.cli.app import run
from flarewright.errors import FlarewrightError
from flarewright.io.measurement.captures import (
    AngleRule,
    parse_rule,
    read_camera,
    read_capture_list,
    read_captures,
)  # fmt: skip

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


def test_a_rule_starts_a_new_angle_when_an_exposure_repeats(folder):
    text = "file,exposure_s,iso,f_number\n" + "".join(f"{k}.npy,{(1, 4)[k % 2]},100,8\n" for k in range(6))
    found = listed(folder, text, AngleRule(1.0, 0.2))
    assert [one.constellation_deg for one in found] == pytest.approx([1.0, 1.0, 1.2, 1.2, 1.4, 1.4])


def test_raw_files_provide_their_exposures(tmp_path):
    for k in range(4):
        write_dng(tmp_path / f"IMG_{k}.dng", np.full((4, 4), 600, np.uint16), exposure=(1, (8, 2)[k % 2]))
    found = read_captures(tmp_path, parse_rule("10-0.5"))
    assert [(one.constellation_deg, one.exposure_s) for one in found] == [
        (10.0, 0.125), (10.0, 0.5), (9.5, 0.125), (9.5, 0.5)
    ]  # fmt: skip
    assert {(one.iso, one.f_number, one.focal_mm) for one in found} == {(200.0, 2.8, 50.0)}
    with pytest.raises(FlarewrightError, match="--angles"):
        read_captures(tmp_path)


def test_raw_files_provide_their_focal_length_beside_a_list(tmp_path):
    write_dng(tmp_path / "a.dng", np.full((4, 4), 600, np.uint16), exposure=(1, 8))
    (tmp_path / "b.dng").write_bytes(b"damaged")
    row = "{}.dng,{},1,100,8{}\n"
    head = "file,constellation_deg,exposure_s,iso,f_number{}\n"
    (tmp_path / "list.csv").write_text(head.format("") + row.format("a", 1, ""))
    (found,) = read_captures(tmp_path / "list.csv")
    assert (found.exposure_s, found.iso, found.f_number, found.focal_mm) == (1.0, 100.0, 8.0, 50.0)
    (tmp_path / "list.csv").write_text(head.format(",focal_mm") + row.format("a", 1, ",35"))
    assert read_captures(tmp_path / "list.csv")[0].focal_mm == 35.0
    # merging reports a damaged file
    (tmp_path / "list.csv").write_text(head.format("") + row.format("b", 1, ""))
    assert read_captures(tmp_path / "list.csv")[0].focal_mm is None


@pytest.mark.parametrize(("text", "rule"), [("0+0.2", (0, 0.2)), ("-5 + .5", (-5, 0.5)), ("30-1", (30, -1))])
def test_rules_are_start_and_step(text, rule):
    assert parse_rule(text) == AngleRule(*rule)


@pytest.mark.parametrize("text", ["", "3", "a+b", "1+0", "1++2", "nan+1", "0+1e3x"])
def test_an_invalid_rule_is_reported(text):
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
        (HEAD + "0.npy,0,,100,8\n", "0.npy in line 2 has no exposure_s"),
        (HEAD + "0.npy,,1,100,8\n", "constellation_deg is missing"),
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
def test_errors_are_reported_with_their_place(folder, text, word):
    with pytest.raises(FlarewrightError, match=word):
        listed(folder, text)


def test_one_error_is_reported_once(folder):
    with pytest.raises(FlarewrightError) as reported:
        listed(folder, "file,constellation_deg\n0.npy,\n9.npy,0\n1.npy,1\n")
    assert [line.partition(";")[0] for line in reported.value.problems] == [
        f"line 3: {folder / '9.npy'} does not exist: check the path and the spelling",
        "2 of 3 photographs have no exposure_s, the first is 0.npy in line 2",
    ]


def test_files_without_exposure_are_reported_in_one_sentence(folder, capsys):
    count = len(list(folder.glob("*.npy")))
    assert run(["measure", "merge", str(folder), "--angles", "0+1", "-o", str(folder / "run")]) == 2
    assert capsys.readouterr().err == (
        f"flarewright: error: {folder}: {count} of {count} photographs have no exposure_s, the first is "
        "0.npy; list them in a captures.csv with file and exposure_s\n"
    )
    for path in folder.glob("*.npy"):
        path.rename(path.with_suffix(".dng"))
    assert run(["measure", "merge", str(folder), "--angles", "0+1", "-o", str(folder / "run")]) == 2
    # each damaged file is reported once
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == count + 1
    assert all(line.count(".dng") == 1 for line in lines)


def test_an_f_number_may_be_unknown_or_rounded(folder):
    found = listed(folder, HEAD + "0.npy,0,1,100,\n1.npy,1,1,100,5.6\n2.npy,2,1,100,5.66\n")
    assert [one.f_number for one in found] == [None, 5.6, 5.66]


def test_two_sources_of_angles_are_refused(folder):
    with pytest.raises(FlarewrightError, match=r"gives constellation_deg of 1\.npy, and so does the rule 0\+0\.5"):
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
        ("{", "not valid JSON"),
        ('{"gain": 1}', "gain"),
        ('{"electrons_per_unit": -1}', "electrons_per_unit"),
        ('{"black_level": 512, "white_level": 511}', "white_level 511 is not above black_level 512"),
        ('{"luminance_cd_m2": 2e6}', "luminance_cd_m2 and solid_angle_sr of the light go together; give both or none"),
        ('{"luminance_cd_m2": 0, "solid_angle_sr": 1e-5}', "luminance_cd_m2"),
        ('{"luminance_cd_m2": 2e6, "solid_angle_sr": 1e999}', "solid_angle_sr"),
        ('{"luminance_cd_m2": 2e6, "solid_angle_sr": 6.284}', "solid_angle_sr: 6.284 is more than the hemisphere"),
    ):
        path.write_text(text)
        with pytest.raises(FlarewrightError, match=word):
            read_camera(path)


THREE = "".join(f"{3 * k + j}.npy,{k},{2**j},100,8\n" for k in range(2) for j in range(3))


def test_lines_in_any_order_are_sorted_and_this_is_reported(folder):
    lines = THREE.splitlines(keepends=True)
    (folder / "captures.csv").write_text(HEAD + "".join([lines[k] for k in (0, 3, 1, 5, 2, 4)]))
    found, remarks = read_capture_list(folder / "captures.csv")
    assert [one.constellation_deg for one in found] == [0.0] * 3 + [1.0] * 3
    assert remarks == ("the lines are not in the order of their angles; sorted",)
    # angles that fall throughout are in order
    (folder / "captures.csv").write_text(HEAD + "".join(lines[3:] + lines[:3]))
    assert read_capture_list(folder / "captures.csv")[1] == ()


def test_one_lost_photograph_is_left_out_where_two_others_remain(folder):
    lines = THREE.splitlines(keepends=True)
    (folder / "captures.csv").write_text(HEAD + THREE)
    assert read_capture_list(folder / "captures.csv")[1] == ()
    # not listed
    (folder / "captures.csv").write_text(HEAD + "".join(lines[:4] + lines[5:]))
    found, (remark,) = read_capture_list(folder / "captures.csv")
    assert len(found) == 5
    assert remark == "the constellation of 1 deg lacks the exposure of 2 s that others have; merged from the other 2"
    # listed, but not on the disk
    (folder / "captures.csv").write_text(HEAD + THREE)
    (folder / "4.npy").unlink()
    found, remarks = read_capture_list(folder / "captures.csv")
    assert [one.file for one in found] == ["0.npy", "1.npy", "2.npy", "3.npy", "5.npy"]
    assert [line.partition(f"{folder}")[0] for line in remarks] == ["line 6: ", remark]
    assert "4.npy does not exist; left out" in remarks[0]
    # a second one of the same constellation
    (folder / "3.npy").unlink()
    with pytest.raises(FlarewrightError, match="does not exist: check the path") as reported:
        read_capture_list(folder / "captures.csv")
    assert len(reported.value.problems) == 2


@pytest.mark.parametrize("lost", [None, (0, 0), (1, 0), (1, 1), (2, 2), (3, 0)])
def test_a_lost_photograph_leaves_the_angles_of_the_others(tmp_path, lost):
    """All exposures behind a lost first one used to move to the angle before theirs."""
    names = [(angle, k) for angle in range(4) for k in range(3) if (angle, k) != lost]
    times = (0.004, 0.02, 0.2)
    for angle, k in names:
        (tmp_path / f"a{angle}-{k}.npy").write_bytes(b"")
    text = HEAD + "".join(f"a{angle}-{k}.npy,,{times[k]},100,8\n" for angle, k in names)
    found = listed(tmp_path, text, AngleRule(1.0, 0.5))
    assert [(one.file, one.constellation_deg) for one in found] == [
        (f"a{angle}-{k}.npy", 1.0 + 0.5 * angle) for angle, k in names
    ]
