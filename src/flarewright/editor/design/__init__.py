"""Design searches of the editor.

- `search_job`: `Solver` searches lenses or coatings on a thread, reports progress, and accepts a result
"""
