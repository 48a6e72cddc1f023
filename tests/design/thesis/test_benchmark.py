"""The thesis' tests: planted solutions, pictures under comparison, and figure numbers."""

import numpy as np
import pytest

from flarewright.design.coatings.colors import colors_of
from flarewright.design.problem.objective import fitness
from flarewright.design.solvers.evolution_log import Limits
from flarewright.design.thesis.benchmark import run_trial, task_of
from flarewright.design.thesis.benchmark_colors import color_task, run_colors
from flarewright.design.thesis.trials import Trial, figures_shown


@pytest.mark.parametrize("case", ["heliar", "canon"])
def test_what_is_planted_is_a_quarter_wave_on_each_surface(case):
    task = color_task(Trial(case, films="quarter-wave"))
    assert np.all((task.planted >= 380.0) & (task.planted <= 750.0))
    assert np.array_equal(colors_of(task.problem, task.planted), task.problem.targets)


@pytest.mark.parametrize(
    ("case", "most"),
    [
        ("heliar", 4),
        pytest.param("heliar", 8, marks=pytest.mark.slow),
        pytest.param("canon", 2, marks=pytest.mark.slow),
    ],
)
def test_planted_quarter_waves_are_found_to_the_last_pixel(case, most):
    trial = Trial(case, films="quarter-wave")
    run, target, found = run_colors(trial, limits=Limits(None, most), seed=1)
    assert run.recovered
    assert run.fitness_algorithm2 < 1e-6
    assert run.psnr_db > 100.0
    assert target.shape == found.shape == (512, 512, 3)
    assert 12.0 < run.psnr_black_db < 30.0
    # the picture has colours
    assert target.std(axis=2).max() > 0.05
    seconds = [point.seconds for point in run.trace]
    assert seconds == sorted(seconds)
    assert run.trace[-1].fitness_algorithm2 == pytest.approx(run.fitness_algorithm2, abs=1e-12)


@pytest.mark.parametrize("most", [1, pytest.param(16, marks=pytest.mark.slow)])
def test_free_films_make_the_colours_of_quarter_waves(most):
    run, _, _ = run_colors(Trial("heliar", films="film"), limits=Limits(None, most), seed=0)
    assert run.psnr_db > 50.0
    assert not run.recovered


@pytest.mark.parametrize("most", [100, pytest.param(1500, marks=pytest.mark.slow)])
def test_ghosts_from_scratch_are_compared_with_what_was_wanted(most):
    trial = Trial("scratch", ghosts=3, unsigned=True)
    run, target, found = run_trial(trial, limits=Limits(None, most), seed=2)
    assert run.psnr_db > run.psnr_black_db + 10.0
    assert np.mean((target - found) ** 2) == pytest.approx(10.0 ** (-run.psnr_db / 10.0))
    assert not run.recovered
    # another seed gives other targets
    assert not np.array_equal(task_of(trial, 2).problem.objective.targets, task_of(trial, 3).problem.objective.targets)


def test_a_lens_drawn_against_itself_is_the_same_picture():
    task = task_of(Trial("heliar", 13.4, unsigned=True))
    target, found = task.pictures(*task.lens)
    assert np.array_equal(target, found)
    assert fitness(task.problem.objective, *task.lens) == 0.0


@pytest.mark.parametrize(
    ("trial", "solvers", "numbers"),
    [
        (Trial("heliar"), ("pools", "pso"), ("6.1", "6.3")),
        (Trial("heliar", 13.4), ("pools", "sade"), ("6.2", "6.4")),
        (Trial("heliar", 13.4), ("pso:5x15", "pso:5x30"), ("6.5", "6.4")),
        (Trial("canon"), ("pso", "sade"), ("6.6", "6.7")),
        (Trial("heliar", films="quarter-wave"), ("pso", "sade"), ("6.8", "6.10")),
        (Trial("canon", films="quarter-wave"), ("pso", "sade"), ("6.9", "6.11")),
        (Trial("heliar", films="film"), ("sade",), ("6.12", "6.13")),
        (Trial("scratch", ghosts=10), ("pso",), ("-", "6.15")),
        (Trial("heliar"), ("pso", "pso:1x500"), ("6.17", "6.3")),
        (Trial("canon"), ("pso:15x15", "pso:1x500"), ("6.18", "6.7")),
        (Trial("heliar", 7.0), ("pso",), ("-", "-")),
        (Trial("scratch", ghosts=7), ("pso", "pso:1x500"), ("-", "-")),
    ],
)
def test_runs_are_the_figures_of_the_thesis(trial, solvers, numbers):
    assert figures_shown(trial, solvers) == numbers
