"""Normal equations that a plain solver fails on."""

import numpy as np
import pytest

from flarewright.measure.core.parameters import Shape, free_numbers
from flarewright.measure.fitting import normal_equations
from flarewright.measure.fitting.ghost_fit import refine
from flarewright.measure.fitting.normal_equations import inverse, solution
from flarewright.measure.fitting.patches import patches_of


def jacobian() -> np.ndarray:
    """Return derivatives of very different scale and full rank."""
    return np.random.default_rng(3).normal(size=(40, 5)) * np.array([1e-3, 1.0, 1e2, 3.0, 1e-1])


def test_the_result_is_the_inverse():
    matrix = jacobian().T @ jacobian()
    assert np.allclose(inverse(matrix) @ matrix, np.eye(5), atol=1e-6)
    side = np.arange(5.0)
    assert np.allclose(matrix @ solution(matrix, side), side)


def test_eigenvalues_that_do_not_converge_raise_no_error(monkeypatch):
    matrix = jacobian().T @ jacobian()
    expected = inverse(matrix)

    def refuse(*_, **__):
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    monkeypatch.setattr(normal_equations.np.linalg, "pinv", refuse)
    assert np.allclose(inverse(matrix) / np.sqrt(np.outer(np.diag(expected), np.diag(expected))),
                       expected / np.sqrt(np.outer(np.diag(expected), np.diag(expected))), atol=1e-5)  # fmt: skip


def test_a_singular_matrix_yields_least_squares_and_leaves_free_numbers_at_0():
    rows = jacobian()
    rows[:, 4] = 0.0
    matrix, seen = rows.T @ rows, rows @ np.array([500.0, 1.0, 0.02, -0.3, 7.0])
    found = solution(matrix, rows.T @ seen)
    assert np.allclose(rows @ found, seen, rtol=1e-5, atol=1e-6)
    assert found[4] == 0.0


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_yield_0(bad):
    matrix = np.eye(3)
    matrix[0, 1] = matrix[1, 0] = bad
    assert not inverse(matrix).any()
    assert not solution(matrix, np.ones(3)).any()


def test_a_fit_ends_when_eigenvalues_do_not_converge(monkeypatch):
    from planted_run import GHOSTS, SIZE, views

    shown = views(GHOSTS[1:2], angles=(6.0, 12.0, 18.0))
    planted = GHOSTS[1]
    numbers = planted.numbers.copy()
    numbers[0] += 2.0

    def refuse(*_, **__):
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    patches = patches_of(planted, shown, 1)
    whole = refine(Shape(numbers), patches, free_numbers(0, 0, 0), width=SIZE[0], error=0.0)
    monkeypatch.setattr(normal_equations.np.linalg, "pinv", refuse)
    fit = refine(Shape(numbers), patches, free_numbers(0, 0, 0), width=SIZE[0], error=0.0)
    assert fit.shape.numbers[0] == pytest.approx(planted.numbers[0], abs=5.0 * fit.uncertainty[0])
    assert np.allclose(fit.uncertainty, whole.uncertainty, rtol=1e-4)
