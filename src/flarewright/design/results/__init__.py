"""Results of a design search: verdict, files, report, and what the ghosts of a measured lens determine.

Public entry points: `report.verdict`, `report.search_summary`, `report.write_folder`, `identify.identify`,
`explain.explain_misfit`, `explain.sentences`.

- `report`: verdict, JSON summary and the output folder with lenses, pictures and an HTML report
- `explain`: `explain_misfit` judges a search for a measured lens; `sentences` words the result
- `identify`: `identify` returns the numbers of a prescription that the ghosts determine
"""
