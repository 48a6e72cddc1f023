"""The command line: one module per command, which parses arguments, calls the program and prints.

Importing this package changes two settings of NumPy, before anything imports it. Its linear algebra library gets one
thread: the program has its own threads, and idle library threads would spin, a fifth of a core while the editor draws.
Its arrays get no huge pages on Linux: a frame makes gigabytes of short-lived arrays, and the system clears a page of
4 kB in the cache just before it is filled, but not one of 2 MB.

- `app`: `main` and `run`: errors and exit codes
- `command_tree`: `command_tree`, `COMMANDS`: which function runs each command
- `partial_work`: finished parts of a command beside its output or in the state folder
- `common`: helpers of several commands: option values, output checks, remarks, JSON, progress bars
- `progress_lines`: `ProgressLines`, progress as lines of JSON
- `option_record`: `with_options`, commands whose options are the fields of a record
- `shared_options`: options that mean the same in many commands
- `option_words`: placeholders of option values in help texts
- `dataset`, `edit`, `gallery`, `looks`, `warm_up`: single commands
- `design`, `lens`, `library`, `measure`, `predict`, `project`, `render`: groups of commands
"""

import os

for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")
