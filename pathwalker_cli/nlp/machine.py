"""Make the machine fit the linear solver, which factorises thousands of small blocks.

One thread: handing such blocks to several threads of OpenBLAS takes two to three times the CPU
time and makes the order of sums, and so the path of a solve, depend on chance.  Freed memory is
kept: the solver asks for the same blocks in every iteration.
"""

from __future__ import annotations

import ctypes
import os
from functools import cache

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Parameters of glibc's `mallopt`."""

_BYTES = 1 << 30


def use_one_blas_thread() -> None:
    """Let OpenBLAS run on one thread unless the environment says otherwise.

    Takes effect for libraries that are loaded afterwards: call it before IPOPT is.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@cache
def keep_freed_memory() -> bool:
    """Serve blocks below 1 GiB from the heap and do not trim it; return whether that is possible.

    Other C libraries than glibc are left as they are.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    return all(mallopt(name, _BYTES) == 1 for name in (_MMAP_THRESHOLD, _TRIM_THRESHOLD))
