"""Solvers for a design problem: the built-in pool search, and evolutionary algorithms from optional packages.

Public entry points: `solvers.chosen`, `solvers.solve_with`, `solvers.make_ready`, `pool_search.solve`,
`search_state.write_state`, `search_state.read_state`.

- `solvers`: `solve_with`, the same interface for every solver
- `pool_search`: `solve`, the built-in solver: iterated local search over pools of minima
- `polish`: local searches, and merging of their minima
- `least_squares`: one Levenberg-Marquardt step inside bounds
- `restarts`: `restart_seed` and `merged`, independent searches of one problem
- `restart_limit`: `MOST_RESTARTS`, the largest number of restarts
- `search_state`: a search as a file that can be resumed
- `genes`: `Genes`, a lens as numbers from 0 to 1 for evolutionary solvers
- `evolution`: pygmo's algorithms on an archipelago
- `cma_es`: CMA-ES with restarts
- `evolution_log`: `Limits`, `Solution`, and the record of an evolutionary search
"""
