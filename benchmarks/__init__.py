"""Benchmarks of Flarewright: `python -m benchmarks`."""

import os

# as the commands do: a second thread of linear algebra waits in a busy loop, and its waiting would count as work
for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(_name, "1")
