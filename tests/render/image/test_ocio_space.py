"""Colour spaces of OpenColorIO: against the built-in matrices, back again, and refused by a sentence."""

import numpy as np
import pytest

from flarewright import Camera, Layer, Light, Output, Project, Quality, shot
from flarewright.cli.app import run
from flarewright.colorimetry import PRIMARIES
from flarewright.errors import ProjectError
from flarewright.io.images.exr import CHROMATICITIES, read_exr
from flarewright.optics.colour.rgb import xyz_to_rgb_matrix
from flarewright.render.image import ocio_space
from flarewright.render.image.ocio_space import check_file_space, config_digest, in_file_space

RENDER = ["render", "triplet-pestrecov", "--light", "9,5", "--fstop", "16", "--size", "32x18", "--quality", "draft"]
RENDER += ["--wavelengths", "3", "--no-starburst", "--no-png", "--float", "-o", "a.exr"]
LIGHT = np.random.default_rng(1).normal(1.0, 2.0, (6, 5, 3)).astype(np.float32)


def project(space, config="ocio://default", **changes):
    output = Output(ocio_space=space, ocio_config=config, starburst=False)
    return Project(
        **{"lens": "triplet-pestrecov", "lights": [Light(field_deg=(9.0, 5.0))], "output": output, **changes}
    )


def converted(space, config="ocio://default"):
    """Return the converted pixels of `LIGHT`, and the space."""
    layer = Layer("beauty", LIGHT, (0, 0, 5, 6))
    (found,), stated = in_file_space([layer], project(space, config))
    return found.pixels, stated


@pytest.fixture
def ocio(monkeypatch):
    monkeypatch.delenv("OCIO", raising=False)
    return pytest.importorskip("PyOpenColorIO", reason="the wheel opencolorio is not installed (extra: color)")


@pytest.mark.parametrize("name", ["ACEScg", "acescg", "lin_ap1", "scene_linear"])
def test_acescg_by_any_of_its_names_is_the_built_in_one(ocio, name):
    pixels, space = converted(name)
    matrix = xyz_to_rgb_matrix("acescg") @ np.linalg.inv(xyz_to_rgb_matrix("rec709"))
    np.testing.assert_allclose(pixels, LIGHT @ matrix.T, rtol=1e-5, atol=1e-5)
    assert (space.name, space.known) == ("ACEScg", "lin_ap1_scene")
    assert PRIMARIES[space.known] == CHROMATICITIES["acescg"]


@pytest.mark.parametrize("known", list(PRIMARIES))
def test_pixels_come_back_and_primaries_are_recognized(ocio, known):
    pixels, space = converted(known)
    assert space.known == known
    config = ocio.Config.CreateFromFile("ocio://default")
    config.getProcessor(known, "lin_rec709_scene").getDefaultCPUProcessor().applyRGB(pixels)
    np.testing.assert_allclose(pixels, LIGHT, atol=2e-5)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("sRGB - Display", "refers to a display and not to a scene"),
        ("Raw", "holds data and no colours"),
        ("ACEScct", "is not linear, so layers would not add up"),
        (
            "linear rec2020",
            "alias 'linear rec2020'; choose rec709, acescg, or a linear one such as Linear Rec.2020",
        ),
    ],
)
def test_other_spaces_are_refused_with_near_names(ocio, name, said):
    with pytest.raises(ProjectError) as refused:
        check_file_space(project(name))
    assert said in str(refused.value)
    assert "or a linear one such as " in str(refused.value)


def test_a_missing_configuration_is_refused_in_one_sentence(ocio, tmp_path):
    with pytest.raises(ProjectError, match=r"none\.ocio cannot be read .*--ocio"):
        check_file_space(project("ACEScg", str(tmp_path / "none.ocio")))
    (tmp_path / "broken.ocio").write_text("no configuration")
    with pytest.raises(ProjectError, match=r"broken\.ocio cannot be read"):
        check_file_space(project("ACEScg", str(tmp_path / "broken.ocio")))


def test_variances_are_not_converted(ocio):
    with pytest.raises(ProjectError, match="variances of reference quality"):
        check_file_space(project("ACEScg", quality=Quality(mode="reference")))


def test_without_the_library_the_sentence_has_the_command(monkeypatch):
    monkeypatch.setattr(ocio_space, "aces_available", lambda: False)
    ocio_space._read.cache_clear()
    with pytest.raises(ProjectError, match=r"pip install 'flarewright\[color\]'"):
        check_file_space(project("ACEScg", "ocio://cg-config-latest"))
    # the built-in ones need nothing
    assert check_file_space(project("ACEScg").replace(output=Output(colorspace="acescg"))) == ()
    (remark,) = check_file_space(project(None))
    assert "ocio_config has no effect" in remark


CONFIG = """ocio_profile_version: 2
roles: {default: wide, %s}
displays: {screen: [!<View> {name: raw, colorspace: wide}]}
colorspaces:
  - !<ColorSpace> {name: %s}
  - !<ColorSpace>
    name: wide
    from_scene_reference: !<MatrixTransform> {matrix: [0.5, 0.25, 0.25, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}
"""


def test_the_configuration_of_the_variable_is_used_and_kept(ocio, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "show.ocio").write_text(CONFIG % ("reference: lin_rec709", "lin_rec709"))
    assert run([*RENDER]) == 0
    plain = read_exr("a.exr")
    monkeypatch.setenv("OCIO", str(tmp_path / "show.ocio"))
    assert run([*RENDER, "--colorspace", "wide"]) == 0
    wide = read_exr("a.exr")
    assert "ocio" in wide.metadata["project"]
    assert "show.ocio" in wide.metadata["project"]
    assert (wide.metadata["colorspace"], wide.metadata["ocio"]) == ("wide", "show.ocio")
    assert not {"chromaticities", "colorInteropID"} & set(wide.header)
    expected = plain.layers[0].pixels @ np.array([[0.5, 0.25, 0.25], [0, 1, 0], [0, 0, 1]]).T
    np.testing.assert_allclose(wide.layers[0].pixels, expected, rtol=1e-5, atol=1e-12)
    # rec709 over a project that has another space
    (tmp_path / "p.toml").write_text(wide.metadata["project"])
    assert run([*RENDER[:1], "--project", "p.toml", "-o", "b.exr", "--colorspace", "rec709", "--no-png"]) == 0
    assert "colorspace" not in read_exr("b.exr").metadata
    capsys.readouterr()
    assert run([*RENDER, "--ocio", "show.ocio"]) == 2
    assert "add --colorspace NAME" in capsys.readouterr().err
    assert run([*RENDER, "--ocio", "show.ocio", "--colorspace", "acescg"]) == 2
    assert "--ocio has no effect on --colorspace acescg" in capsys.readouterr().err


def test_a_configuration_that_relates_to_nothing_is_refused(ocio, tmp_path):
    (tmp_path / "own.ocio").write_text(CONFIG % ("reference: own", "own"))
    with pytest.raises(ProjectError, match="does not say how its spaces relate to others"):
        check_file_space(project("wide", str(tmp_path / "own.ocio")))


def test_a_shot_is_drawn_again_for_another_space_and_makes_no_film_of_it(ocio, tmp_path):
    names = tmp_path / "f.####.exr"
    settings = {"camera": Camera(size_px=(32, 18)), "quality": Quality(mode="draft", wavelengths=3)}
    wanted = project("lin_rec2020_scene", **settings)
    assert shot(wanted, names, frames="1", processes=1).frames[0].drawn
    header = read_exr(tmp_path / "f.0001.exr").header
    np.testing.assert_allclose(header["chromaticities"], PRIMARIES["lin_rec2020_scene"], rtol=1e-6)
    assert header["colorInteropID"] == "lin_rec2020_scene"
    assert not shot(wanted, names, frames="1", processes=1).frames[0].drawn
    assert config_digest(wanted) != config_digest(project("ACEScg")) != ""
    assert shot(project("ACEScg", **settings), names, frames="1", processes=1).frames[0].drawn
    with pytest.raises(ProjectError, match=r"a film is made of frames in Rec\.709 or ACEScg"):
        shot(wanted, names, frames="1", movie=tmp_path / "f.mp4")


def test_colours_are_not_compressed_into_other_primaries_than_those_of_the_file(ocio):
    made = project("ACEScg")
    compressed = made.replace(output=made.output.replace(gamut="compress"))
    with pytest.raises(ProjectError, match='gamut = "compress" moves colours into the primaries of rec709 or acescg'):
        check_file_space(compressed)
