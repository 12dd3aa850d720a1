"""Every numerical choice of this room that no config asks for, with its reason."""

from __future__ import annotations

from typing import Final

VELOCITY_SIZE: Final = 5.0
RATE_SIZE: Final = 20.0
ACCELERATION_SIZE: Final = 50.0
FORCE_SIZE: Final = 20.0
CONTACT_FORCE_SIZE: Final = 100.0
HEIGHT_SIZE: Final = 0.1
"""What counts as 1 for the solver: a velocity [m/s, rad/s], an activation rate [1/s], an
acceleration [m/s^2, rad/s^2], a reserve force or residual [N, N m], a contact force [N], a height
[m]; with these the prototypes needed the fewest iterations."""

# Cost.
PEAK_POWER: Final = 8
"""Power of the mean that stands for the largest activation."""
PEAK_FLOOR: Final = 1e-6
"""Keeps the derivative of the root finite where no muscle is active: a peak of 0.18."""
NEAR_GROUND: Final = 0.015
"""Height over which the ground matters to a foot that swings [m]: people clear it by 1 to 2 cm."""
COMFORT_ROUNDING: Final = 0.01
"""Half width to which the edge of a comfortable range is rounded off [rad]."""
NO_EDGE: Final = 10.0
"""Edge of a comfortable range that is not given [rad]: no joint gets there."""

# Starts.
PHASE_SPLITS: Final = (0.33, 0.5, 0.33, 0.5)
"""Share of the first phase of each pair: recordings do not tell when heels lift or toes land."""
LIFTED: Final = 0.01
"""Height above its level in stance at which a heel or toe of a recording counts as lifted [m]."""
FEWEST_FRAMES: Final = 2
"""Frames of a recorded phase, at the least."""
SLOWEST: Final = 0.1
"""Least speed of a stylised gait as a Froude number's root, v / sqrt(g leg length)."""
TYPICAL_PATIENCE: Final = 200
"""Iterations from a typical walk after which a stride is tracked instead; most need 40 to 120."""
TYPICAL_BARRIER: Final = 1e-4
TYPICAL_ACTIVATION: Final = (3e-3, 0.95)
"""First barrier from a typical walk, and range of its activations: larger barriers leave it."""
START_ACTIVATION: Final = 0.2
"""Activation of all muscles where the search begins."""
CROUCH_SPREAD: Final = (0.35, 1.0)
STRIDE_SPREAD: Final = (0.8, 1.5)
SPEED_SPREAD: Final = (1.0, 1.6)
"""Ranges of several starts: knee flexion [rad], stride length [leg lengths], and speed as a
multiple of the study's own start."""

# Stages of a solve.
HIGHEST_PELVIS: Final = 2.0
"""Upper bound of the pelvis' height [m], which no patient reaches."""
TRACKING: Final = {"tracking": 10.0, "reserve": 10.0, "smoothing": 0.1}
"""Weights of the first stage: follow the stride, carried by reserve forces where needed."""
TRACKING_TOLERANCE: Final = 1e-2
TRACKING_BARRIER: Final = 0.1
TRACKING_BARRIER_FACTOR: Final = 100.0
"""A start need not be exact; far from any solution a large barrier that falls early takes the
fewest iterations."""
TRACKING_ANGLES: Final = (-2.5, 2.5)
"""Range of the joint angles there [rad]: a recording may lie outside the prediction's ranges."""
FURTHER_ANGLES: Final = {
    "mtp": (-1.2, 0.6, "what toes can do"),
    "hinge": (-1.2, 1.2, "further than any stop lets a hinge turn"),
}
"""Ranges of joints that no recording knows [rad], and why: a big toe extends by some 70 and flexes
by some 35 degrees; stops of orthoses are steep."""
FADED: Final = 0.02
"""Share of the orthosis that acts in the first stage, whose stride knows nothing of it."""
HELPED: Final = {"effort": 1e-2, "rate": 2e-4, "acceleration": 1e-5, "reserve": 10.0}
"""Weights by which reserves at the joints help a solve that failed: hardly any effort matters."""
LEAST_HELP: Final = {**HELPED, "reserve": 1e3}
"""Weights of the least help: what is left of the reserves is what the muscles lack."""
LEAST_LACK: Final = 0.01
"""Share of a strength below which a torque is what the price of reserves leaves, not a lack."""
PATIENCE: Final = 400
"""Iterations on the first mesh after which reserves have to help; most need 60 to 300."""
BARRIER_SHARE: Final = 1e-2
"""Barrier, as a share of the tolerance of the stage before, that a warm start begins with."""

# Mesh.
MESHING_TOLERANCE: Final = 1e-4
PROVING_TOLERANCE: Final = 1e-7
"""Relative tolerances of the integrator that a mesh is refined by, where errors of 1e-3 are to be
found within some per cent, and of the one that has the last word."""
EAGER_ROUND: Final = 2
EAGER_SHARE: Final = 0.3
"""Round from which intervals are split at a share of the tolerance already: the solution moves
from round to round, and would take the error to another interval that just met it before."""
COST_AIM: Final = 0.3
"""Share of the cost's tolerance that intervals which are not split may change it by."""
COST_SURE: Final = 0.5
COST_SIZE: Final = 2.0
"""Shares of that tolerance below which the estimated change, which is good to a factor of two, and
the sum of its sizes over all intervals let a mesh pass: neighbours undo most of each other's."""
AIM: Final = 2.0
MOST_PARTS: Final = 4
"""By how much a split interval shall beat the tolerance, as the next solution moves a little, and
into how many parts it is split at the most, as the error of a coarse one is a rough guess."""

# Neighbours of an optimum.
WATCHDOG: Final = {"watchdog_shortened_iter_trigger": 1, "watchdog_trial_iter_max": 30}
"""A neighbour further off is reached by full steps that the filter alone would cut to nothing."""
WARM_ITERATIONS: Final = 150
"""Iterations after which a warm start is given up; most take about ten, far ones about fifty."""
NEAR_ROWS: Final = 2e-3
FURTHER_ROWS: Final = 1e-2
"""Largest root mean square violation of rows [solver units] by the start of a near neighbour, and
of one further off: strengths that vary by 10 % reach 7e-3; masses and lengths, which need another
start, begin at 1.5e-2."""
NEAR_BOUNDS: Final = 0.2
"""Largest violation of a bound [solver units] by the start of a near one; 5 % of a spring: 0.1."""
FURTHER_START: Final = (1e-6, 3e-4)
FAR_START: Final = (1e-5, 1e-2)
"""First barrier, and distance from the bounds [solver units], of neighbours that are not near: the
further one is, the more bounds become active or inactive on the way to it, and from close to the
bounds steps are cut to a few per cent for dozens of iterations."""
DIFFERENCE: Final = 1e-4
"""Relative change of a number of the problem by which its derivatives are taken."""
WAY_SHARE: Final = 1e-2
"""The same on the way to a neighbour, as a share of it: what it adds to the error is that share of
the second order."""

# Multiple shooting.
SHOOTING_BARRIER: Final = 1e-5
SHOOTING_PUSH: Final = 1e-3
"""Barrier and distance from the bounds at the start: a larger barrier leaves the neighbourhood of
the motion that is handed in, a smaller distance blocks the first steps."""
NEXT_PUSH: Final = 1e-8
"""Distance from the bounds in later rounds: they start where the round before ended."""
ROUND_BARRIER_SHARE: Final = 1e-2
"""Barrier at the end of a round, as a share of its tolerance; the next round begins with it."""
STEP_MARGIN: Final = 3.0
"""By how much integration steps shall beat their tolerance: the next solution moves a little."""
