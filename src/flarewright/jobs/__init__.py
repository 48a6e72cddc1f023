"""Lists of independent items, worked off by processes on all cores; nothing here knows what an item is.

- `frame_list`: `parse_frames`, `FramePattern` and `parse_chunk`: the words for frames of a shot
- `processes`: `work_off` shares items among processes and yields the results as they come; `fitting`, how many
- `worker`: `serve`, the loop of such a process
"""
