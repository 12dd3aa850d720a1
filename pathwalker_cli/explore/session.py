"""A run that is played with: where its dials stand, what was solved, and what is near."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from pathwalker_cli.errors import InputError
from pathwalker_cli.explore.dials import Settings, case_at, dials_of, settings_of
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.nlp.watch import Observer
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import require_optimum
from pathwalker_cli.studies.run import Outcome, run_study

STOPPED: Final = "stopped by the user"
"""Status of a solve that its observer ended."""


class Session:
    """The optimum of a run that is looked at, and those around it.

    The observer hears every iteration, and may end a solve.

    Raises:
        NotConvergedError: If the run cannot be solved again.
    """

    def __init__(self, run: Run, observer: Observer | None = None) -> None:
        self.run = run
        self.resolver = Resolver(run.case, run.motion, run.multipliers, observer=observer)
        found = require_optimum(self.resolver, run, run.config.solver.tolerance)
        self.dials = dials_of(found)
        # with every spring held, as in what is near
        self._home = self.resolver.resolve(case_at(run.case, self.dials, {}), found)
        self.optimum: Optimum = self._home
        self.settings: Settings = settings_of(self.dials)
        self.away = False
        """Whether what is looked at was not yet solved from the run itself."""

    def go_home(self) -> None:
        """Go back to the run itself."""
        self.optimum, self.settings, self.away = self._home, settings_of(self.dials), False

    def first_order(self, settings: Settings) -> Optimum | None:
        """Return the optimum extrapolated to other settings; nothing is solved.

        None where no derivative leads there: where other numbers are the problem's to choose, or
        none are.
        """
        before, after = (settings_of(self.dials) | dict(s) for s in (self.settings, settings))
        if [v is None for v in before.values()] != [v is None for v in after.values()]:
            return None
        try:
            return self.optimum.towards(self._at(settings))
        except InputError:  # the end of what is allowed
            return None

    def _at(self, settings: Settings) -> Optimum:
        """Return what is looked at in the problem of other settings."""
        case = case_at(self.run.case, self.dials, settings)
        return self.resolver.restored(case, self.optimum.result)

    def solve(self, settings: Settings, start: Optimum | None = None) -> Optimum:
        """Solve the problem with other settings, from `start`, and go there; if that fails, stay.

        Args:
            settings: The settings.
            start: Where to begin, in the problem of the settings; what is looked at if left out.

        Raises:
            InputError: If config or patient refuse the numbers.
        """
        if dict(settings) == settings_of(self.dials):
            self.go_home()
            return self.optimum
        start = start or self._at(settings)
        end = self.resolver.solved(start, insist=False)
        if not (end.converged or end.result.status == STOPPED or self.optimum is self._home):
            end = self.resolver.solved(replace(start, result=self._home.result), insist=False)
        if end.converged:
            self.optimum, self.settings = end, dict(settings)
            self.away = True
        return end

    def solve_from_run(self) -> Optimum:
        """Solve what is looked at once more, from the run, and stay with the better one.

        Where a solve ends depends on where it began: on the way that was taken.
        """
        end = self.resolver.resolve(self.optimum.case, self._home, insist=False)
        self.away = end.result.status == STOPPED  # then it is still to be done
        if end.converged and end.cost < self.optimum.cost:
            self.optimum = end
        return end

    def save(self, folder: Path) -> Outcome:
        """Write what is looked at as a run, its mesh refined where the config asks for that.

        Raises:
            DataError: If the folder holds something else or cannot be written.
        """
        case = self.optimum.case.with_values({"verdict": False})
        shown = replace(self.optimum.solution, case=case)
        start = replace(self.run, motion=self.optimum.motion)
        return run_study(case, folder, start, found=shown if shown.converged else None)
