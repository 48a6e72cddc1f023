"""Workers that differ from the caller are refused, or a remark says how."""

from __future__ import annotations

import os
from dataclasses import replace

import pytest

from flarewright import __version__
from flarewright.errors import FlarewrightError
from flarewright.jobs.cluster.checks import check_threads, differences, refuse_other_versions
from flarewright.jobs.cluster.worker_side import Order, facts, missing_place, work


def test_equal_workers_pass_without_remarks():
    here = facts()
    assert {"python", "numpy", "numba", "OpenEXR", "processor"} <= set(here.versions)
    refuse_other_versions(here, {"tcp://a:1": here, "tcp://b:1": here})
    assert differences(here, [here, here]) == []


def test_another_version_of_the_program_is_refused():
    here = facts()
    other = replace(here, flarewright="0.0.1", host="node7")
    words = r"worker tcp://b:1 on node7 has flarewright 0\.0\.1, and this machine .*; install version .* there"
    with pytest.raises(FlarewrightError, match=words):
        refuse_other_versions(here, {"tcp://a:1": here, "tcp://b:1": other})
    many = {f"tcp://n{k}:1": other for k in range(9)}
    with pytest.raises(FlarewrightError, match=r"workers tcp://n0:1 on node7, .* and 6 more have flarewright"):
        refuse_other_versions(here, many)
    # as Dask hands on what a worker cannot import
    missing = Exception("ModuleNotFoundError(\"No module named 'flarewright'\")")
    with pytest.raises(FlarewrightError, match="worker tcp://a:1 has no flarewright, or a version without clusters"):
        refuse_other_versions(here, {"tcp://a:1": missing})
    with pytest.raises(FlarewrightError, match=r"tcp://a:1 does not answer \(Timeout\); restart it"):
        refuse_other_versions(here, {"tcp://a:1": OSError("Timeout")})


def test_other_versions_that_matter_for_bytes_are_remarks():
    here = facts()
    other = replace(here, versions={**here.versions, "numpy": "1.0", "processor": "abacus"})
    found = differences(here, [here, other, other])
    assert len(found) == 2
    assert f"numpy is {here.versions['numpy']} here and 1.0 on 2 of 3 workers" in found[0] + found[1]
    lacking = replace(here, versions={name: text for name, text in here.versions.items() if name != "scipy"})
    assert "and missing on 1 of 1 workers" in differences(here, [lacking])[0]


def test_workers_of_several_threads_are_refused():
    check_threads({"tcp://a:1": 1}, "tcp://s:1")
    with pytest.raises(FlarewrightError, match=r"dask worker tcp://s:1 --nworkers 8 --nthreads 1$"):
        check_threads({"tcp://a:1": 1, "tcp://b:1": 8}, "tcp://s:1")


def test_an_item_is_worked_off_in_the_folder_of_the_caller(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    mark = tmp_path / "there" / "mark"
    mark.write_bytes(b"x")
    order = Order("cluster_work:add", 1, __version__, str(tmp_path / "there"), str(mark))
    assert work(100, order, 5) == ("done", (105, os.getpid(), 1, str(tmp_path / "there")))
    # where nothing is stated the folder stays
    assert work(1, replace(order, folder="", mark=""), 5)[1][3] == str(tmp_path / "there")


def test_an_item_on_a_worker_that_joined_late_is_checked_too(tmp_path):
    order = Order("cluster_work:add", 1, "0.0.1", "", "")
    assert work(1, order, 5)[0] == "refused"
    assert f"has flarewright {__version__}, not 0.0.1: update it" in work(1, order, 5)[1]
    order = replace(order, version=__version__, folder=str(tmp_path / "none"))
    assert "does not see the working folder" in work(1, order, 5)[1]
    order = replace(order, folder="", mark=str(tmp_path / "none" / "mark"))
    assert work(1, order, 5)[1].endswith(
        f"does not see the folder {tmp_path / 'none'}: give folders that all machines share"
    )
    assert missing_place(str(tmp_path), "") == ""
    kind, words = work(1, replace(order, mark="", function="cluster_work:none"), 5)
    assert kind == "failed"
    assert "AttributeError" in words
