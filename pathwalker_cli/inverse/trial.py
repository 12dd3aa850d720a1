"""A recorded trial and what follows from it."""

from __future__ import annotations

from dataclasses import dataclass

from pathwalker_cli.conventions import Condition
from pathwalker_cli.inverse.cycles import GaitCycle
from pathwalker_cli.inverse.kinematics import MarkerResiduals
from pathwalker_cli.inverse.markers import Gap
from pathwalker_cli.inverse.stance_checks import StanceForce
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.recordings import CompactRecording
from pathwalker_cli.trajectory import Trajectory


@dataclass(frozen=True)
class Trial(CompactRecording):
    """A recorded trial and what follows from it.

    Args:
        condition: "barefoot" or "orthosis".
        cycles: Gait cycles that the study looks at.
        tau: Residuals and joint torques, NaN where a force is not measured, or None.
        stances: What the plates know about every stance.
        markers: Distances of the markers from the walker, None without C3D.
        gaps: Gaps in the marker paths.
        published: Whether forces, torques and cycles are those of the article's own method.
        walk: Markers and filtered plates in every frame, x along the walk; None without C3D.
        doubts: What in the file may be wrong, a sentence each.
    """

    condition: Condition
    cycles: tuple[GaitCycle, ...]
    tau: Trajectory | None = None
    stances: tuple[StanceForce, ...] = ()
    markers: MarkerResiduals | None = None
    gaps: tuple[Gap, ...] = ()
    published: bool = False
    walk: Recording | None = None
    doubts: tuple[str, ...] = ()

    @property
    def first_frame(self) -> int:
        """Number that the recording program gives the first frame."""
        return self.walk.first_frame if self.walk else 0

    @property
    def remarks(self) -> tuple[str, ...]:
        """How the file was read, a sentence each."""
        return self.walk.remarks if self.walk else ()

    def measured(self, cycle: GaitCycle) -> bool:
        """Return whether the force of the stance that begins a cycle is known."""
        return self.published or any(
            item.measured and (item.stance.side, item.stance.strike) == (cycle.side, cycle.start)
            for item in self.stances
        )
