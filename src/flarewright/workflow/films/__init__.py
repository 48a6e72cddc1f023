"""Films of finished frames.

- `assembly`: `assemble_film` encodes and joins the parts of a film; `FilmResult`
- `look`: `FilmLook`, one exposure and one curve for all frames
"""
