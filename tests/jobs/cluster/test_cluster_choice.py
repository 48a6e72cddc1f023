"""The words of --cluster."""

from __future__ import annotations

import pytest

from flarewright.errors import ProjectError
from flarewright.jobs.cluster.choice import LocalChoice, RunningChoice, SlurmChoice, parse_cluster
from flarewright.jobs.cluster.executor import workers_of


@pytest.mark.parametrize(
    ("text", "choice"),
    [
        ("local", LocalChoice()),
        (" local:12 ", LocalChoice(12)),
        ("tcp://10.0.0.1:8786", RunningChoice("tcp://10.0.0.1:8786")),
        ("tls://head-1.farm.example:8786", RunningChoice("tls://head-1.farm.example:8786")),
        ("tcp://[fe80::1]:8786", RunningChoice("tcp://[fe80::1]:8786")),
        ("slurm:my farm.toml", SlurmChoice("my farm.toml")),
        ("slurm:C:/farm.toml", SlurmChoice("C:/farm.toml")),
    ],
)
def test_a_cluster_is_read(text, choice):
    assert parse_cluster(text) == choice


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "write local, local:4"),
        ("local:0", "'0' is no number of worker processes from 1 to 1024"),
        ("local:x", "'x' is no number"),
        ("local:", "'' is no number"),
        ("local:99999", "no number of worker processes"),
        ("local:-1", "no number of worker processes"),
        ("local:\u0663", "no number of worker processes"),
        ("tcp://host", "no address of a Dask scheduler; write for example tcp://"),
        ("tcp://host:0", "no address"),
        ("tcp://host:99999", "no address"),
        ("tcp://ho st:1", "no address"),
        ("host:8786", "write tcp://host:8786, "),
        ("slurm:", "names no file"),
        ("pbs:a.toml", "'pbs:a.toml' is unknown"),
    ],
)
def test_another_text_is_one_sentence(text, words):
    with pytest.raises(ProjectError, match=r"^cluster ") as found:
        parse_cluster(text)
    assert words in str(found.value)


def test_options_that_contradict_a_cluster_are_refused():
    assert workers_of(None, 3, 2) == 3
    assert workers_of("local", 3, None) == 3
    assert workers_of("local", None, None) is None
    assert workers_of("local:5", None, 2) == 5
    assert workers_of("tcp://a:1", None, None) is None
    with pytest.raises(ProjectError, match=r"--processes 3 and --cluster local:5 both set the processes; keep one"):
        workers_of("local:5", 3, None)
    for given in ((2, None), (None, 2)):
        with pytest.raises(ProjectError, match="has no effect on --cluster tcp://a:1"):
            workers_of("tcp://a:1", *given)
