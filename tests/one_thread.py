"""A thread of linear algebra for each process of pytest-xdist; imported before all that loads numpy, which reads
the variables then.
"""

import os

DISTRIBUTED = "PYTEST_XDIST_WORKER" in os.environ

if DISTRIBUTED:
    os.environ |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
