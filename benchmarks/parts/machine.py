"""What this machine is, and what it can do at best on one thread."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from pathwalker_cli.nlp.kernels import kernels_path

PACKAGES = ("casadi", "pin", "numpy", "scipy")


def description() -> dict[str, Any]:
    """Return processor, cores and versions."""
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    path = kernels_path()
    return {
        "processor": models[0] if models else platform.processor(),
        "cores": len(os.sched_getaffinity(0)),
        "python": platform.python_version(),
        "compiled kernels": "none" if path is None else path.name,
        **{name: version(name) for name in PACKAGES},
        "date": time.strftime("%Y-%m-%d %H:%M"),
        "load before": round(os.getloadavg()[0], 2),
    }


def limits() -> dict[str, float]:
    """Return GFlop/s of a matrix product and GB/s of copies."""
    a, b, c = (np.random.default_rng(k).random((512, 512)) for k in range(3))
    far, away = np.ones(8_000_000), np.zeros(8_000_000)
    near, by = np.ones(16_384), np.ones(16_384)
    return {
        "dgemm_gflops": 2 * 512**3 / _least(lambda: np.matmul(a, b, out=c)) / 1e9,
        "copy_gbs": 2 * far.nbytes / _least(lambda: np.copyto(away, far)) / 1e9,
        "cached_copy_gbs": 2 * near.nbytes / _least(lambda: np.copyto(by, near), 20) / 1e9,
    }


def _least(action: Callable[[], object], calls: int = 1, seconds: float = 0.5) -> float:
    """Return the least seconds of an action, tried for some time, so many calls at a time."""
    least, end = np.inf, time.perf_counter() + seconds
    while time.perf_counter() < end:
        began = time.perf_counter()
        for _ in range(calls):
            action()
        least = min(least, (time.perf_counter() - began) / calls)
    return float(least)
