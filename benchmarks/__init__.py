"""Speed, as ratios within one run: `python -m benchmarks`. Linear algebra runs on one thread unless told otherwise."""

import os

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # read when NumPy is loaded, which is after this file
