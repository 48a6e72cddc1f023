"""Robust statistics: a spread that a few outliers do not change."""

from __future__ import annotations

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation, 1 / Phi^-1(3/4).

Source: Hampel 1974, The influence curve and its role in robust estimation, section 5.
Test: `tests/measure/core/test_robust.py`.
"""
