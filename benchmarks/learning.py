"""Coverage of learnt numbers: strides of known numbers plus noise, learnt again, draw by draw.

Every draw takes numbers from half of the priors, predicts a stride, adds to every curve and number
of the walk the error that the mean of so many recorded strides has, learns from it, and counts how
many of the true numbers lie within one and two stated standard deviations.

python benchmarks/learning.py [DRAWS] [STRIDES]
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from pathwalker_cli.results.run_folder import load_run
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.studies.base import base_case, load_study, resolver_of
from pathwalker_cli.studies.learn import LearnStudy
from pathwalker_cli.studies.learn.fit import Learner, descend
from pathwalker_cli.studies.learn.targets import Target
from pathwalker_cli.studies.neighbours import Journal
from pathwalker_cli.studies.run import run_study

HARMONICS = 4
"""Harmonics of the gait cycle that noise is made of: strides differ smoothly."""


def noise(target: Target, strides: int, rng: np.random.Generator) -> np.ndarray:
    """Return a smooth error of the mean of so many strides, whose RMS is spread / sqrt(strides)."""
    phase = np.linspace(0.0, 2.0 * np.pi, target.mean.size)
    waves = [np.ones_like(phase)]
    waves += [f(k * phase) * np.sqrt(2.0) for k in range(1, HARMONICS) for f in (np.sin, np.cos)]
    size = target.spread / np.sqrt(strides * len(waves))
    return np.asarray(size * rng.standard_normal(len(waves)) @ np.array(waves))


def main(draws: int = 20, strides: int = 13) -> None:
    """Print coverage."""
    study = load_study("learn", LearnStudy)
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run_study(base_case(study), folder / "base")
        run, used = load_run(folder / "base"), time.process_time()
        resolver = resolver_of(run)
        walker = resolver.optimum.solver
        recorded = study.targets(study.recorded(walker))
        within = []
        for draw in range(draws):
            truth = 0.5 * rng.standard_normal(len(study.numbers))
            places = [folder / f"{draw}-{part}" for part in ("truth", "steps")]
            made, learner = (
                Learner(
                    study.numbers, run.case, recorded, resolver, Journal(place, run, resolver), str
                )
                for place in places
            )
            optimum = made.optimum(truth)
            if not optimum.converged:
                print(f"draw {draw}: no stride with these numbers", flush=True)
                continue
            stride = stride_of(optimum.series)
            learner.targets = tuple(
                replace(t, mean=t.of(stride) + noise(t, strides, rng)) for t in recorded
            )
            end = descend(learner, np.zeros(truth.size), study.steps, study.precision)
            deviations = np.sqrt(np.diag(np.linalg.inv(end.jac.T @ end.jac)))
            missed = np.abs(end.x - truth) / deviations
            told = deviations < np.sqrt(0.5)
            within.append([np.mean(missed < 1), np.mean(missed < 2), np.mean(missed[told] < 2)])
            print(f"draw {draw}: misfit {2 * end.cost:.2f}, within one deviation "
                  f"{within[-1][0]:.0%}, two {within[-1][1]:.0%}, of those told "
                  f"{within[-1][2]:.0%}; {time.process_time() - used:.0f} CPU s so far",
                  flush=True)  # fmt: skip
        one, two, told = np.mean(within, axis=0)
        print(f"{len(within)} draws: {one:.0%} within one deviation, {two:.0%} within two, "
              f"{told:.0%} of the numbers that recordings tell within two")  # fmt: skip


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
