"""Every numerical choice of this room, with its reason."""

from __future__ import annotations

from typing import Final

UNIT_SIZES: Final = {
    "N m/rad": 50.0, "N m": 10.0, "rad": 0.1, "deg": 10.0, "kg": 1.0, "m": 0.1, "N m s/rad": 0.1,
    "N/m": 1e4, "N s/m": 100.0,
}  # fmt: skip
"""What counts as 1 for the solver, by unit; for stiffnesses prototypes needed the fewest
iterations with this, the others are of the size of the numbers themselves."""

NEWTON_STEPS: Final = 9
"""Enough for 1e-14 on every corner in use; the flattest are the eccentric velocity curves."""

# Shape of the orthosis' curve.
CURVINESS: Final = 0.7
BLEND: Final = 0.1
"""Part of the way from free play to hard stop over which spring and stop are blended."""
STEEP: Final = 0.5
"""Stiffness, as a share of 2 tau_0/theta_W, up to which the preload rises with 4 tau_0/theta_W."""
NO_PRELOAD: Final = 1e-12
"""Keeps the ratio of an orthosis without preload finite [N m]."""

# The cuff of an orthosis.
CUFF_MODULUS: Final = 60e3
"""Elastic modulus of a leg under a cuff [Pa]: of lower limbs Zheng and Mak (1999) found up to
58 kPa at the beginning of an indentation, rising by 22 to 547 kPa times the strain."""
CUFF_TISSUE: Final = 0.06
"""Thickness of what a cuff presses together, as a share of the shank: 17 mm of a seven-year-old;
assumed."""
CUFF_SHEAR: Final = 1.0 / 3.0
"""Stiffness of a cuff along the shank beside that across: shear of what keeps its volume."""
CUFF_RELAXATION: Final = 0.01
"""Damping of a cuff beside its stiffness [s]: a shell of some hundred grams just does not swing on
the leg; assumed."""

# Feet.
ROCKER_SHARES: Final = {"heel": 0.18, "toe": 0.18, "tip": 0.05}
"""Radii of the rockers as shares of the foot from heel to ball: 35 mm of an adult, the size of a
heel's pad; the tip of the toes 1 cm."""

ROUNDNESS: Final = 1.5
"""Radius of a sole where it lies flat, beside its length: under a child that crouches the centre of
pressure moves 2 to 4 cm while the bare foot turns by .17 rad (see docs/theory.md)."""

TOES_MASS_SHARE: Final = 0.138
"""Toes' part of the mass of the foot: 0.2166 of 1.5666 kg in the lower limb of Delp et al. (1990),
as OpenSim distributes it."""
TOE_STIFFNESS: Final = 25.0
"""Stiffness of an adult's metatarsophalangeal joint [N m/rad]; Falisse et al. (2022)."""
TOE_DAMPING: Final = 2.0
"""Its damping [N m s/rad]; Falisse et al. (2022)."""

SOLE_DEPTH: Final = 0.117
"""How deep one foot sinks under body weight, as a share of its length: 24.5 mm of an adult of 75 kg
whose heel and toe, 0.21 m apart, have a stiffness of 5e7 N/m^3 each."""
SOLE_DAMPING: Final = 0.85
"""Share by which each m/s of sinking raises its force [s/m]."""
SOLE_CREEP: Final = 0.01
"""Sliding speed at which friction is 46 % of dry friction [m/s]."""
SOLE_EDGE: Final = 1e-4
"""Height over which the depth under ground is rounded off [m]: a sole that just touches it
bears some 1e-5 N."""

FRICTION: Final = 0.8
"""Coefficient of friction, as published; Chang and Matz (2001)."""

# Passive tissue.
STEEPEST: Final = 5.0
"""Exponent beyond which an exponential goes on as a parabola: 148 N m of an adult, which no joint
of a gait comes near, while a start may."""
DAMPING: Final = 0.1
"""Damping of hip, knee and ankle [N m s/rad]: a few tenths of a newton metre in swing, of the size
that pendulum tests of relaxed legs find."""
