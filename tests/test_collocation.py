"""The transcription on textbook problems with closed-form optima."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from pathwalker_cli.nlp.frozen import FrozenTerms
from pathwalker_cli.nlp.ipopt import IpoptSettings, solve_program
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion
from pathwalker_cli.ocp.problem import (
    Boundary,
    BoundTable,
    MultiPhaseProblem,
    Phase,
    ProblemNumbers,
    Rows,
    Variables,
)


def double_integrator(
    nonlinear: bool = False, power: int = 2
) -> tuple[MultiPhaseProblem, ProblemNumbers]:
    """Return: move a unit mass by 1 m from rest to rest in 1 s with least integral of force^power.

    Two phases of 0.5 s; the force is the algebraic variable; optimum 12 (closed form) for a power
    of 2, force 6 - 12 t.  With `nonlinear` the force acts through a frozen exponential that undoes
    a logarithm.
    """
    x = Variables.make("x", ("position", "speed"), np.array([1.0, 2.0]))
    y = Variables.make("y", ("smooth",), 1.0)
    u = Variables.make("u", ("rate",), 1.0)
    p = Variables.make("p", ("free",), 1.0)
    shared, data = ca.SX.sym("mass"), ca.SX.sym("data", 1)
    phases = []
    for name in ("first", "second"):
        z = Variables.make("z", ("acceleration", "force"), 5.0)
        frozen = FrozenTerms()
        force = z.symbol[1]
        if nonlinear:
            force = 100 * (frozen.taylor(_exponential, force / 100) - 1)
            force = 100 * ca.log(1 + force / 100)
        phases.append(
            Phase(
                name=name,
                algebraic=z,
                derivative=ca.vertcat(x.symbol[1], z.symbol[0]),
                residual=Rows.make(shared * z.symbol[0] - force, ("newton",), 3.0),
                path=Rows.make(x.symbol[1], ("forward",), 1.0, -10.0, np.inf),
                end=Rows(),
                fixed_at_end=(),
                integrands=z.symbol[1] ** power,
                frozen=frozen,
            )
        )
    first = tuple(ca.SX.sym(f"f{i}", k) for i, k in enumerate((2, 1, 1)))
    last = tuple(ca.SX.sym(f"l{i}", k) for i, k in enumerate((2, 1, 1)))
    durations, integrals = ca.SX.sym("T", 2), ca.SX.sym("s", 1)
    rows = Rows.make(
        ca.vertcat(first[0], last[0] - ca.vertcat(1, 0)), ("x0", "v0", "x1", "v1"), 1.0
    )
    problem = MultiPhaseProblem(
        states=x,
        smooth=y,
        controls=u,
        parameters=p,
        shared=shared,
        point_data=data,
        integrals=("effort",),
        integral_scale=np.array([10.0]),
        phases=tuple(phases),
        node_rows=Rows.make(u.symbol, ("quiet",)),
        boundary=Boundary(first, last, durations, integrals, rows, integrals[0]),
    )
    bounds = BoundTable({("duration",): (0.5, 0.5), ("free",): (0.0, 0.0)})
    return problem, ProblemNumbers(np.array([1.0]), bounds, lambda phase, at: np.zeros(1))


def _exponential(x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    value = ca.exp(x)
    return value, value, value


def at_rest(problem: MultiPhaseProblem, intervals: int, degree: int) -> PhasedMotion:
    """Return a start at rest."""
    n = intervals
    phases = tuple(
        PhaseMotion(
            phase.name,
            0.5,
            np.linspace(0, 1, n + 1),
            np.zeros((n + 1, 2)),
            np.zeros((n + 1, 1)),
            np.zeros((n + 1, 1)),
            np.zeros((n + 1, 1)),
            np.zeros((n, degree, 2)),
            np.zeros((n, degree, 2)),
        )
        for phase in problem.phases
    )
    return PhasedMotion(phases, np.zeros(1))


@pytest.mark.parametrize("nonlinear", [False, True])
def test_double_integrator_reaches_the_closed_form_optimum(nonlinear: bool) -> None:
    problem, numbers = double_integrator(nonlinear)
    start = at_rest(problem, 3, 3)
    program = CollocationProgram(CollocationBlocks(problem, 3), numbers, start.meshes)
    result = solve_program(program, program.to_unknowns(start), IpoptSettings(tolerance=1e-9))
    assert result.converged
    assert result.objective == pytest.approx(12.0, rel=1e-9)
    motion = program.to_motion(result.unknowns)
    for i, phase in enumerate(motion.phases):
        fractions = np.linspace(0, 1, 7)
        time = 0.5 * (i + fractions)
        states = phase.states_at(fractions)
        assert states[:, 0] == pytest.approx(3 * time**2 - 2 * time**3, abs=1e-9)
        assert states[:, 1] == pytest.approx(6 * time - 6 * time**2, abs=1e-9)
        assert phase.algebraic_at(fractions)[:, 1] == pytest.approx(6 - 12 * time, abs=1e-6)


def test_block_derivatives_agree_with_those_of_the_whole() -> None:
    problem, numbers = double_integrator(nonlinear=True)
    start = at_rest(problem, 2, 3)
    program = CollocationProgram(CollocationBlocks(problem, 3), numbers, start.meshes)
    functions = program.functions
    rng = np.random.default_rng(1)
    x, lam = rng.normal(size=program.size), rng.normal(size=program.rows)
    p = program.parameters
    nlp = functions["nlp"]
    gradient = np.asarray(functions["grad_f"](x, p)[1]).ravel()
    jacobian = np.asarray(ca.DM(functions["jac_g"](x, p)[1]))
    hessian = np.asarray(ca.DM(functions["hess_lag"](x, p, 1.5, lam)))
    hessian = hessian + np.triu(hessian, 1).T

    def lagrangian_gradient(at: np.ndarray) -> np.ndarray:
        slope = np.asarray(functions["grad_f"](at, p)[1]).ravel()
        return 1.5 * slope + np.asarray(ca.DM(functions["jac_g"](at, p)[1])).T @ lam

    step = 1e-6
    for k in range(x.size):
        e = np.zeros(x.size)
        e[k] = step
        (f1, g1), (f0, g0) = nlp(x + e, p), nlp(x - e, p)
        assert float(f1 - f0) / (2 * step) == pytest.approx(gradient[k], abs=1e-6)
        difference = np.asarray(g1 - g0).ravel() / (2 * step)
        assert difference == pytest.approx(jacobian[:, k], abs=1e-6)
        curve = (lagrangian_gradient(x + e) - lagrangian_gradient(x - e)) / (2 * step)
        assert curve == pytest.approx(hessian[:, k], abs=1e-5)
