"""Make complete lenses of imported prescriptions.

- `configurations`: `positions_of`, positions of a lens from the settings of a file
- `patent_repair`: `repair`, validates and repairs a `.lens` table
- `semi_diameters`: `with_semi_diameters`, estimates missing semi-diameters
- `sequential_import`: `lens_of_sequence`, converts a sequential ray-trace file
"""
