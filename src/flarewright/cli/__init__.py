"""The command line.

Here, before anything imports NumPy, its library of matrices is told to work on one thread: the program's own threads
share the work, and others beside them would wait for more by spinning, a fifth of a core while the editor draws.
"""

import os

for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(_name, "1")
