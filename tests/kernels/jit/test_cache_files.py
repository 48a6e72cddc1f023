"""A damaged, full or unwritable cache of compiled kernels costs a compilation, and one sentence on stderr."""

import errno
import pickle

import numpy as np
import pytest
from numba.core import config
from numba.core.caching import CacheImpl, IndexDataCacheFile

from flarewright.kernels.jit import cache_files, decorators


def double(x):
    return 2.0 * x


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(cache_files, "_reported", set())
    return tmp_path / "cache"


def hits(value=1.5):
    """Call a fresh kernel as another process would; return whether its code came from the cache."""
    kernel = decorators.compiled(double)
    assert kernel(value) == 2 * value
    return sum(kernel.stats.cache_hits.values()) == 1


@pytest.fixture
def files(place):
    assert not hits()
    assert hits()
    (index,), (data,) = place.rglob("*.nbi"), place.rglob("*.nbc")
    return {"index": index, "data": data}


DAMAGE = {
    "emptied": lambda data, _: b"",
    "cut": lambda data, random: data[: int(random.integers(1, len(data)))],
    "flipped": lambda data, random: flipped(data, int(random.integers(8 * len(data)))),
    "flipped in its first byte": lambda data, random: flipped(data, int(random.integers(8))),
    "foreign": lambda data, random: random.bytes(len(data)),
}


def flipped(data, bit):
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


@pytest.mark.parametrize("kind", ["index", "data"])
def test_a_damaged_file_is_reported_and_written_again(files, kind, capfd):
    whole, random = files[kind].read_bytes(), np.random.default_rng(1)
    for how, damaged in DAMAGE.items():
        files[kind].write_bytes(damaged(whole, random))
        cache_files._reported.clear()
        assert not hits(), how
        said = capfd.readouterr().err
        assert said.startswith("flarewright: ")
        assert str(files[kind]) in said
        assert said.count("\n") == 1
        assert hits(), how
        assert not capfd.readouterr().err


def test_numbas_own_file_is_replaced_without_a_word(files, capfd):
    """Releases before the digests wrote these; after an update they are obsolete, not damaged."""
    checked = decorators.compiled(double)._cache._cache_file
    numbas = IndexDataCacheFile(checked._cache_path, "", checked._source_stamp)
    numbas._index_path = checked._index_path
    numbas._save_index({})
    assert pickle.loads(files["index"].read_bytes()) == numbas._version
    assert not hits()
    assert hits()
    assert not capfd.readouterr().err


def test_code_of_another_signature_is_not_run(files):
    """A rewritten index can name a file that another signature has written, when the disk fills in between."""
    files["index"].unlink()
    kernel = decorators.compiled(double)
    checked = kernel._cache._cache_file
    checked._save_index({kernel._cache._index_key((), kernel.targetctx.codegen()): files["data"].name})
    assert checked.load(kernel._cache._index_key((), kernel.targetctx.codegen())) is None


def test_a_full_disk_is_reported_once_and_the_run_goes_on(place, capfd, monkeypatch):
    def full(_self, _path):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(cache_files.CheckedFile, "_open_for_write", full)
    assert not hits()
    assert not hits()
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert str(place) in said
    assert "no space left on device" in said


def test_an_unwritable_folder_is_reported(place, tmp_path, capfd, monkeypatch):
    place.write_text("a file, so no folder can be made")
    kernel = decorators.compiled(double)
    said = capfd.readouterr().err
    assert said.count(str(place)) == 1
    assert str(kernel._cache.cache_path) in said
    # neither can any other folder
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    cache_files._reported.clear()
    assert decorators.compiled(double)(1.5) == 3.0
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert "every run compiles again" in said
    assert str(place) in said


def test_a_closed_stderr_does_not_matter(files, monkeypatch):
    files["data"].write_bytes(b"")
    monkeypatch.setattr("sys.stderr", None)
    assert not hits()


def test_unloadable_code_is_compiled_again(files, capfd, monkeypatch):
    loaded = decorators.compiled(double)
    monkeypatch.setattr(type(loaded._cache._impl), "rebuild", lambda *_: 1 / 0)
    assert not hits()
    assert str(files["index"]) in capfd.readouterr().err
