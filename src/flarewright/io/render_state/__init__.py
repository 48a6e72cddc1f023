"""State of renders between runs of the program.

- `damaged_archive`: `is_rest_of_archive`, whether a file that cannot be read was an archive of ours
- `flare_cache`: `read_cache`, `write_cache`, flare pictures of a prediction
- `kept_arrays`: `read_arrays`, `write_arrays`, arrays of any interrupted computation with their digest
- `partial_planes`: `read_planes`, `write_planes`, ghosts of an interrupted final render
- `reference_state`: `read_reference_state`, `write_reference_state`, interrupted reference renders
"""
