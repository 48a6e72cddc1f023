"""The command line: one module per command, which parses arguments, calls the program and prints.

Importing this package limits NumPy's linear algebra library to one thread, before anything imports NumPy. The program
has its own threads, and idle library threads would spin: a fifth of a core while the editor draws.

- `app`: `main` and `run`: the command tree, errors and exit codes
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
