"""Design searches of the editor.

- `kept_search`: the state of a search in a file, from which a search of an ended editor resumes
- `search_job`: `Solver` searches lenses or coatings on a thread, reports progress, and accepts a result
"""
