"""Where every unknown of a transcribed problem stands in its vector."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Generic, NamedTuple, TypeVar

import numpy as np

from pathwalker_cli.ocp.problem import BoundTable, MultiPhaseProblem, Variables

NODE: Final = ("states", "smooth", "controls", "integrals")
"""What stands at every node of collocation, in this order."""

P = TypeVar("P")


class Bounded(NamedTuple):
    """Places of unknowns, and under which names, phase and end their bounds are looked up."""

    places: np.ndarray
    names: tuple[str, ...]
    phase: str = ""
    end: bool = False


@dataclass(frozen=True)
class Layout(Generic[P]):
    """Places of all unknowns, ordered by time; P tells the places of one phase.

    Nodes are those of the mesh; of multiple shooting, the ends of all steps but for the controls.

    Args:
        scale: Physical units per solver unit, shape (n,).
        names: Name of every unknown and where it stands, n pairs.
        durations: Phase durations, shape (phases,).
        parameters: Free parameters, shape (np,).
        states: x at the nodes, shape (nodes, nx).
        smooth: y at the nodes, shape (nodes, ny).
        controls: Controls at the nodes of the mesh, shape (mesh nodes, nu).
        integrals: Running costs at the nodes, shape (nodes, ni).
        phases: Places of each phase.
    """

    scale: np.ndarray
    names: tuple[tuple[str, str], ...]
    durations: np.ndarray
    parameters: np.ndarray
    states: np.ndarray
    smooth: np.ndarray
    controls: np.ndarray
    integrals: np.ndarray
    phases: tuple[P, ...]

    @property
    def size(self) -> int:
        """Number of unknowns n."""
        return len(self.scale)

    def bounds(
        self, problem: MultiPhaseProblem, table: BoundTable, others: Iterable[Bounded]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return scaled bounds of all unknowns: durations, parameters, first states, and others.

        Running costs begin with 0; what is not named is free.
        """
        lower, upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        lengths = [
            Bounded(self.durations[i : i + 1], ("duration",), one.name)
            for i, one in enumerate(problem.phases)
        ]
        parameters = Bounded(self.parameters, problem.parameters.names)
        first = Bounded(self.states[0], problem.states.names, "first")
        for places, names, phase, end in (parameters, *lengths, *others, first):
            lower[places], upper[places] = table.arrays(names, phase, end)
        lower[self.integrals[0]] = upper[self.integrals[0]] = 0.0
        return lower / self.scale, upper / self.scale


class PlaceBook:
    """Hands out places of unknowns one after the other, those that stand once first.

    Args:
        controls: What stands in the place of its controls.
    """

    def __init__(self, problem: MultiPhaseProblem, controls: Variables) -> None:
        self._scale: list[float] = []
        self._names: list[tuple[str, str]] = []
        self._kinds = {
            "states": (problem.states.names, problem.states.scale),
            "smooth": (problem.smooth.names, problem.smooth.scale),
            "controls": (controls.names, controls.scale),
            "integrals": (problem.integrals, problem.integral_scale),
        }
        durations = [self._places(("duration",), np.ones(1), p.name) for p in problem.phases]
        self._durations = np.concatenate(durations)
        self._parameters = self.take(problem.parameters, "all phases")
        self.nodes: dict[str, list[np.ndarray]] = {kind: [] for kind in self._kinds}

    def _places(self, names: tuple[str, ...], scale: np.ndarray, where: str) -> np.ndarray:
        start = len(self._scale)
        self._scale += scale.tolist()
        self._names += [(name, where) for name in names]
        return np.arange(start, len(self._scale))

    def take(self, variables: Variables, where: str) -> np.ndarray:
        """Return places for these unknowns."""
        return self._places(variables.names, variables.scale, where)

    def take_node(self, where: str, *kinds: str) -> None:
        """Note places at a further node for these of states, smooth, controls and integrals."""
        for kind in kinds:
            self.nodes[kind].append(self._places(*self._kinds[kind], where))

    def layout(self, phases: Iterable[P]) -> Layout[P]:
        """Return the places of all unknowns."""
        return Layout(
            scale=np.array(self._scale),
            names=tuple(self._names),
            durations=self._durations,
            parameters=self._parameters,
            phases=tuple(phases),
            **{kind: np.array(places) for kind, places in self.nodes.items()},
        )


@dataclass(frozen=True)
class PhasePlaces:
    """Places of one phase of collocation with N intervals of d points.

    Args:
        nodes: Node numbers, shape (N + 1,).
        inner_states: x at the points, shape (N, d, nx); the last point is the next node.
        algebraic: z at the points, shape (N, d, nz).
    """

    nodes: np.ndarray
    inner_states: np.ndarray
    algebraic: np.ndarray


def collocation_layout(
    problem: MultiPhaseProblem, meshes: tuple[np.ndarray, ...], degree: int
) -> Layout[PhasePlaces]:
    """Return the places of all unknowns of collocation."""
    book, phases = PlaceBook(problem, problem.controls), []
    book.take_node(f"{problem.phases[0].name} at 0 % of the phase", *NODE)
    for phase, mesh in zip(problem.phases, meshes, strict=True):
        first, inner, algebraic = len(book.nodes["states"]) - 1, [], []
        for end in mesh[1:]:
            where = f"{phase.name} at {100 * end:.0f} % of the phase"
            points = [book.take(problem.states, where) for _ in range(degree - 1)]
            algebraic.append([book.take(phase.algebraic, where) for _ in range(degree)])
            book.take_node(where, *NODE)
            inner.append([*points, book.nodes["states"][-1]])
        nodes = np.arange(first, len(book.nodes["states"]))
        phases.append(PhasePlaces(nodes, np.array(inner), np.array(algebraic)))
    return book.layout(phases)
