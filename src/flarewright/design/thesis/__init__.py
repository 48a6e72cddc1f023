"""The tests of Van Acoleyen 2025, chapter 6, as a benchmark of solvers.

Public entry points: `trials.Trial`, `benchmark.run_trial`, `benchmark_colors.run_colors`, `figures.write_figures`.

- `trials`: `Trial`: the tests, the thesis' results, and the measures for comparison
- `benchmark`: `run_trial` searches the ghosts of a known lens
- `benchmark_colors`: `run_colors` searches the colours of known coatings
- `figures`: the thesis' figures, tables and an HTML report of runs
"""
