"""A Cryptomatte: published hashes, identifiers that are plain floats, and what another program finds in the file."""

import json

import numpy as np
import OpenEXR
import pytest

from flarewright.io.images.cryptomatte import NAME, identifier, matte_attributes, matte_layers, murmur3_32
from flarewright.io.images.exr import read_exr, write_exr
from flarewright.model import Layer
from flarewright.model.matte import GhostMatte

SIZE = (40, 24)


# smhasher's verification values, as tabulated for MurmurHash3_x86_32
@pytest.mark.parametrize(
    ("text", "seed", "expected"),
    [
        ("", 0, 0x00000000),
        ("", 1, 0x514E28B7),
        ("", 0xFFFFFFFF, 0x81F16F39),
        ("a", 0x9747B28C, 0x7FA09EA6),
        ("aa", 0x9747B28C, 0x5D211726),
        ("aaa", 0x9747B28C, 0x283E0130),
        ("aaaa", 0x9747B28C, 0x5A97808A),
        ("abc", 0, 0xB3DD93FA),
        ("hello", 0, 0x248BFA47),
        ("hello, world", 0, 0x149BBB7F),
        ("The quick brown fox jumps over the lazy dog", 0, 0x2E4FF723),
    ],
)
def test_hashes_are_the_published_ones(text, seed, expected):
    assert murmur3_32(text.encode(), seed) == expected


# from the manifest of a picture that the authors of Cryptomatte publish as a sample
@pytest.mark.parametrize(
    ("name", "expected"), [("bunny", "13851a76"), ("bush", "f763d090"), ("flowerA.flowerA_petal1.:1015", "914754e4")]
)
def test_identifiers_are_those_of_the_authors_sample(name, expected):
    assert f"{identifier(name):08x}" == expected


def test_every_identifier_is_a_plain_float_also_where_the_hash_is_none():
    names = [f"{j}-{i}" for j in range(60) for i in range(j)] + ["starburst", "scatter"]
    hashes = np.array([murmur3_32(name.encode()) for name in names], dtype=np.uint32)
    found = np.array([identifier(name) for name in names], dtype=np.uint32)
    flat = np.isin(hashes >> 23 & 0xFF, (0, 0xFF))
    # one in 128 hashes would be infinite, NaN or denormal
    assert 3 < flat.sum() < 40
    np.testing.assert_array_equal(found[~flat], hashes[~flat])
    np.testing.assert_array_equal(found[flat], hashes[flat] ^ (1 << 23))
    assert np.isfinite(found.view(np.float32)).all()
    assert (np.abs(found.view(np.float32)) >= np.finfo(np.float32).tiny).all()
    assert len(set(found.tolist())) == len(names)


@pytest.fixture
def matte():
    rng = np.random.default_rng(3)
    light = -np.sort(-rng.random((4, SIZE[1], SIZE[0])).astype(np.float32), axis=0)
    objects = np.argsort(rng.random((5, SIZE[1], SIZE[0])), axis=0)[:4].astype(np.int32)
    light[2:, :6], objects[2:, :6] = 0.0, -1
    light[:, 0], objects[:, 0] = 0.0, -1
    return GhostMatte(("3-2", "7-3", "sensor-4", "7-3-5-2", "starburst"), objects, light, light.sum(axis=0) * 1.25)


@pytest.fixture
def layers():
    rng = np.random.default_rng(1)
    whole = (0, 0, *SIZE)
    return [Layer(name, rng.random((SIZE[1], SIZE[0], 3), dtype=np.float32), whole) for name in ("beauty", "ghosts")]


def decoded(channels, hashed):
    """Return the matte of an object as the specification decodes it: coverage wherever a rank has the identifier."""
    own = np.uint32(int(hashed, 16)).view(np.float32)
    pairs = [(k, red, green) for k in (0, 1) for red, green in (("R", "G"), ("B", "A"))]
    return sum(
        np.where(channels[f"{NAME}{k:02d}.{red}"] == own, channels[f"{NAME}{k:02d}.{green}"], np.float32(0.0))
        for k, red, green in pairs
    )


@pytest.mark.parametrize("settings", [{}, {"one_part": True}, {"compression": "dwaa"}, {"pixel_type": "float"}])
def test_a_file_has_the_shares_under_the_names(tmp_path, matte, layers, settings):
    path = tmp_path / "a.exr"
    write_exr(path, layers, SIZE, matte=matte, **settings)
    file = OpenEXR.File(str(path), separate_channels=True)
    channels = {name: c.pixels for part in file.parts for name, c in part.channels.items()}
    assert {channels[f"{NAME}{k:02d}.{c}"].dtype for k in (0, 1) for c in "RGBA"} == {np.dtype(np.float32)}
    header = file.parts[0].header
    key = f"cryptomatte/{murmur3_32(NAME.encode()):08x}"[:19]
    assert [header[f"{key}/{word}"] for word in ("name", "hash", "conversion")] == [
        NAME,
        "MurmurHash3_32",
        "uint32_to_float32",
    ]
    manifest = json.loads(header[f"{key}/manifest"])
    assert tuple(manifest) == matte.names
    for name, hashed in manifest.items():
        np.testing.assert_array_equal(decoded(channels, hashed), matte.share(name))
    # where there is no object, there is neither an identifier nor coverage
    assert not any(channels[f"{NAME}{k:02d}.{c}"][0].any() for k in (0, 1) for c in "RGBA")


@pytest.mark.parametrize("one_part", [False, True])
def test_a_matte_is_no_layer_of_light(tmp_path, matte, layers, one_part):
    write_exr(tmp_path / "a.exr", layers, SIZE, matte=matte, one_part=one_part)
    write_exr(tmp_path / "b.exr", layers, SIZE, one_part=one_part)
    found, plain = read_exr(tmp_path / "a.exr"), read_exr(tmp_path / "b.exr")
    assert [layer.name for layer in found.layers] == ["beauty", "ghosts"]
    assert found.metadata == plain.metadata
    for one, other in zip(found.layers, plain.layers, strict=True):
        np.testing.assert_array_equal(one.pixels, other.pixels)


def test_openimageio_reads_the_matte(tmp_path, matte, layers):
    oiio = pytest.importorskip("OpenImageIO", reason="the wheel OpenImageIO is not installed (extra: oracle)")
    path = tmp_path / "a.exr"
    write_exr(path, layers, SIZE, matte=matte)
    file = oiio.ImageInput.open(str(path))
    for k, (name, pixels) in enumerate(matte_layers(matte), len(layers)):
        assert file.seek_subimage(k, 0)
        assert file.spec().channelnames == tuple(f"{name}.{channel}" for channel in "RGBA")
        np.testing.assert_array_equal(file.read_image(k, 0, 0, 4, oiio.FLOAT), pixels)
        for attribute, text in matte_attributes(matte.names).items():
            assert file.spec().getattribute(attribute) == text
    file.close()
