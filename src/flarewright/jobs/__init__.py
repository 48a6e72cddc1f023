"""Lists of independent items, worked off by processes on all cores or by a cluster; nothing here knows what an item is.

- `frame_list`: `parse_frames`, `FramePattern` and `parse_chunk`: the words for frames of a shot
- `processes`: `work_off` shares items among processes and yields the results as they come; `fitting`, how many
- `answers`: `Done`, and `result_of` an answer
- `cluster`: the workers of a Dask cluster (`open_cluster`), for `processes`
- `worker`: `serve`, the loop of such a process
- `one_heap`: how a process allocates: `share_one_heap`, less memory for its threads, and `keep_freed_memory`
"""
