"""State of renders between runs of the program.

- `flare_cache`: `read_cache`, `write_cache`, flare pictures of a prediction
- `reference_state`: `read_state`, `write_state`, interrupted reference renders
"""
