"""Films: frames as plates, and finished frames as a film; with PyAV, an optional package.

- `film_kind`: `is_film`, the suffixes of films
- `film_file`: `open_film`, what a film states, and the times of its frames: `Film`
- `film_frame`: `read_film_frame`, one frame as a plate
- `film_colour`: `FilmCoding`, and linear pixels of the codes of a frame
- `film_time_code`: `time_code_after`, the time code of a frame from that of the first one
- `film_writer`: `write_film`, H.264 or ProRes; `join_films`
- `decoder`: `opened`, `video_of`: a film opened for reading, safe from what other files it names
"""
