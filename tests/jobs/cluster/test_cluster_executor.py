"""Items on a cluster: all results, errors in sentences, a lost worker loses nothing, no process is left."""

from __future__ import annotations

import os
import sys
import time

import cluster_work
import pytest

from flarewright.errors import FlarewrightError, ProjectError
from flarewright.jobs.cluster.executor import Cluster, open_cluster
from flarewright.jobs.processes import work_off


def through(connection, function="cluster_work:add", items=range(12), context=100, **more):
    cluster = Cluster(connection, True)
    found = work_off(function, context, items, processes=2, threads=3, what="frame", executor=cluster, **more)
    return list(found)


def test_all_items_come_back_and_those_ahead_are_few():
    connection = cluster_work.Connection()
    done = through(connection, items=range(3000))
    assert sorted(one.item for one in done) == list(range(3000))
    assert all(one.result[:3] == (100 + one.item, os.getpid(), 3) for one in done)
    assert connection.grown == (2, 3)
    assert connection.results == 3000
    # the context is one task, and not sent with each item
    assert [key.split("-")[0] for key in connection.client.submitted].count("context") == 1
    # results that are not fetched yet, and tasks ahead
    assert connection.client.most <= 2 * 256
    assert connection.client.priorities == sorted(connection.client.priorities, reverse=True)
    assert len(set(connection.client.priorities)) == 3000
    assert through(connection, items=()) == []


def test_errors_of_an_item_are_raised_here():
    with pytest.raises(FlarewrightError, match="no space left") as found:
        through(cluster_work.Connection(), "cluster_work:refuse", context=2)
    assert found.value.problems == ("one", "two")
    with pytest.raises(RuntimeError, match=r"frame 2: [\s\S]*a bug"):
        through(cluster_work.Connection(), "cluster_work:refuse", (2,), context=1)


def test_an_item_that_no_worker_survives_is_one_sentence():
    with pytest.raises(
        FlarewrightError, match=r"^4 workers ended one after the other at frame 0 .*finished work is kept"
    ):
        through(cluster_work.Connection(cluster_work.KilledWorker("frame")))
    with pytest.raises(FlarewrightError, match=r"a worker cannot work off frame 0 \(no module\); install flarewright"):
        through(cluster_work.Connection(ImportError("no module")))
    with pytest.raises(RuntimeError, match="frame 0: ValueError: odd"):
        through(cluster_work.Connection(ValueError("odd")))


def test_a_lost_scheduler_is_one_sentence():
    connection = cluster_work.Connection()

    def gather(futures):
        raise TimeoutError

    connection.client.gather = gather
    with pytest.raises(FlarewrightError, match=r"the connection with the cluster is lost .*repeat the command"):
        through(connection)


def test_a_scheduler_that_is_lost_while_items_are_submitted_is_one_sentence():
    connection = cluster_work.Connection()
    submit = connection.client.submit

    def broken(function, *arguments, key, pure, priority=0):
        if key.endswith("-300"):
            connection.client.status = "closed"
            raise RuntimeError("the client is closed")
        return submit(function, *arguments, key=key, pure=pure)

    connection.client.submit = broken
    with pytest.raises(FlarewrightError, match=r"the connection with the cluster is lost \(RuntimeError\)"):
        through(connection, items=range(1000))


def test_a_missing_package_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    words = r"^--cluster needs the package distributed; install it with: pip install 'flarewright\[cluster\]'$"
    with pytest.raises(FlarewrightError, match=words), open_cluster("local:2", tmp_path):
        pass
    with pytest.raises(ProjectError, match="is unknown"), open_cluster("farm", tmp_path):
        pass


# ---------------------------------------------------------------------------------------------------------------------
# With Dask: seconds for its import in each process

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def alive(number):
    try:
        with open(f"/proc/{number}/stat") as file:
            # a zombie has ended
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
def test_a_real_cluster_works_off_several_lists(tmp_path, capfd):
    pytest.importorskip("distributed", reason="needs the extra cluster")
    said = []
    with open_cluster("local:2", tmp_path, said.append) as cluster:
        done = list(
            work_off("cluster_work:add", 100, range(40), processes=2, threads=1, what="frame", executor=cluster)
        )
        assert sorted(one.result[0] for one in done) == list(range(100, 140))
        workers = {one.result[1] for one in done}
        assert os.getpid() not in workers
        # one can have worked off all items before the other one has started
        assert len(workers) in (1, 2)
        assert cluster.workers == 2
        assert {one.result[3] for one in done} == {os.getcwd()}
        with pytest.raises(FlarewrightError, match="no space left"):
            list(work_off("cluster_work:refuse", 2, range(3), processes=2, threads=1, executor=cluster))
        # it is of use after an error
        again = list(work_off("cluster_work:add", 0, (1,), processes=2, threads=1, executor=cluster))
        assert again[0].result[0] == 1
    assert not any(alive(worker) for worker in workers)
    # without bokeh there is no dashboard
    assert all("dashboard" in line for line in said)
    assert capfd.readouterr() == ("", "")


@posix
@pytest.mark.slow
def test_a_lost_worker_is_replaced_and_its_item_repeated(tmp_path):
    pytest.importorskip("distributed", reason="needs the extra cluster")
    said = []
    with open_cluster("local:2", tmp_path, said.append) as cluster:
        done = list(
            work_off(
                "cluster_work:die_once", str(tmp_path), range(60), processes=2, threads=1, what="frame",
                executor=cluster,
            )
        )  # fmt: skip
        assert sorted(one.result[0] for one in done) == list(range(60))
    assert (tmp_path / "killed").exists()
    assert [line for line in said if "signal 9" in line]


@posix
@pytest.mark.slow
def test_an_item_that_kills_every_worker_ends_the_list(tmp_path):
    pytest.importorskip("distributed", reason="needs the extra cluster")
    with (
        open_cluster("local:1", tmp_path) as cluster,
        pytest.raises(
            FlarewrightError, match=r"^4 workers ended one after the other at frame \d|^8 worker processes ended"
        ),
    ):
        list(work_off("cluster_work:die", 1, range(3), processes=1, threads=1, what="frame", executor=cluster))


@pytest.mark.slow
def test_a_cluster_that_is_not_there_is_one_sentence_within_seconds(tmp_path):
    pytest.importorskip("distributed", reason="needs the extra cluster")
    started = time.monotonic()
    words = r"^no Dask scheduler answers at tcp://127\.0\.0\.1:9 within 5 s"
    with pytest.raises(FlarewrightError, match=words), open_cluster("tcp://127.0.0.1:9", tmp_path):
        pass
    assert time.monotonic() - started < 30.0
    assert list(tmp_path.iterdir()) == []
