"""An orthosis in words: angles in degrees with their direction, so that a wrong sign is seen."""

from __future__ import annotations

from typing import Final

from pathwalker_cli.conventions import SIDES, to_degrees
from pathwalker_cli.patient import OrthosisData

__all__ = ["angle_words", "orthosis_rows"]

_KINDS: Final = {"dorsiflexion": "K_D", "plantarflexion": "K_P"}


def angle_words(angle: float) -> str:
    """Return an ankle angle [rad, + plantarflexion] in degrees with its direction."""
    degrees = f"{float(to_degrees(abs(angle))):.1f}"
    if degrees == "0.0":
        return "0 deg"
    return f"{degrees} deg {'plantarflexion' if angle > 0.0 else 'dorsiflexion'}"


def orthosis_rows(orthosis: OrthosisData) -> list[tuple[str, str]]:
    """Return label and text of what is worn on each leg and which springs there are."""
    mass = orthosis.mass
    play = float(to_degrees(orthosis.free_play))
    stops: dict[str, str] = {
        side: f"{angle_words(orthosis.dorsiflexion_stop[side])} to "
        f"{angle_words(orthosis.plantarflexion_stop[side])}"
        for side in SIDES
    }
    if len(set(stops.values())) == 1:
        stops = {" and ".join(SIDES): stops[SIDES[0]]}
    rows = [
        (
            "orthosis",
            f"per leg {mass.shank:g} kg on the shank, {mass.foot:g} kg on the foot; right and "
            f"left: neutral angle {angle_words(orthosis.neutral_angle)}, play {play:.1f} deg "
            f"around it, preload {orthosis.preload_torque:g} N m either way",
        ),
        *(("stops", f"{side}: {text}") for side, text in stops.items()),
    ]
    span = orthosis.stiffness_range
    ranges = [f"{k} {_range(getattr(span, name))}" for name, k in _KINDS.items()]
    rows.append(("springs", f"{', '.join(ranges)} N m/rad ({span.source})"))
    if orthosis.springs is not None:
        named = [
            f"{k} " + ", ".join(f"{s.name} {s.stiffness:g}" for s in getattr(orthosis.springs, n))
            for n, k in _KINDS.items()
        ]
        rows.append(("real springs", f"{'; '.join(named)} N m/rad ({orthosis.springs.source})"))
    return rows


def _range(pair: tuple[float, float]) -> str:
    return f"{pair[0]:g} to {pair[1]:g}"
