"""Searches of lenses as library calls, from the targets of a project to a folder with lenses and report.

- `flare_targets`: `project_of_model` and `project_of_picture`, projects whose targets are the ghosts of a flare
- `lens_search`: `search_lenses` searches lenses for a project's targets and returns a `LensSearch`
- `search_restarts`: `search_restarts` searches several times independently, by processes or on a cluster
- `search_folder`: `search_in_folder` stores a search while it runs, and writes its lenses and report
"""
