"""Runs solvers on problems, one process a measurement, and judges what they answer."""

import os

# NumPy and SciPy bring an OpenBLAS each. Idle threads of the one spin on the processors that the other
# needs: with two threads on two cores Goldfarb–Idnani takes up to four times as long. 2⁴ cycles is the
# shortest wait before they sleep. Read when the library is loaded, so it has to stand here.
os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "4")
