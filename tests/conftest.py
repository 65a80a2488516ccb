"""One thread for linear algebra: matrices here are small, and threads that wait for each other only cost."""

from __future__ import annotations

import os

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # read when NumPy is loaded, which is after this file
