"""How a drone holds, reacts to a loss, and how much it sends: values, bounds, allowed combinations. Pure."""

from dataclasses import dataclass, field
from typing import Any, Final

import msgspec

from server.kernel.bad_field import BadField
from server.kernel.refusal import Refusal
from wire.autopilots.registry import PROFILES
from wire.control_messages import SafetySettings, StreamSettings
from wire.open_holds import LostAction
from wire.stream_profiles import StreamChoice

_FAILSAFES: Final = tuple(profile.failsafe for profile in PROFILES if profile.failsafe is not None)
LADDERS: Final = tuple(tuple(mode.name for mode in modes.ladder) for modes in _FAILSAFES)
"""For each autopilot that can hold, the modes of its ladder, altitude hold last."""
ALTITUDE_HOLDS: Final = frozenset(modes.altitude_hold.name for modes in _FAILSAFES)

BOUNDS: Final[dict[str, tuple[float, float]]] = {
    "sticks_stale_s": (0.2, 5.0),
    "sticks_late_s": (0.1, 5.0),
    "commands_late_s": (0.5, 30.0),
    "lost_hold_s": (0.5, 30.0),
    "lost_action_s": (2.0, 3600.0),
    "rtt_limit_ms": (50.0, 10_000.0),
    "rtt_limit_s": (0.2, 30.0),
}
"""Minimum and maximum of each number. Below, an ordinary hiccup of a mobile network holds the drone; above, nothing
does."""


class BadDroneSettings(Refusal):
    """Each value is valid, but the combination is not."""


@dataclass(frozen=True)
class DroneSettings:
    """Both are for the agent. The tower monitors the round trip in addition."""

    safety: SafetySettings = field(default_factory=SafetySettings)
    stream: StreamSettings = field(default_factory=StreamSettings)

    def as_values(self) -> dict[str, Any]:
        """Keyed by the names of the REST interface."""
        safety = msgspec.structs.asdict(self.safety)
        return {
            **safety,
            "hold_ladder": list(self.safety.hold_ladder),
            "lost_action": self.safety.lost_action.value,
            "stream_profile": self.stream.profile.value,
        }


DEFAULTS: Final = DroneSettings()
_SAFETY_NAMES: Final = frozenset(SafetySettings.__struct_fields__)
_RENAMED: Final = {"nothing": "stay"}
"""Loss actions under the names that older versions stored."""


def check_ladder(ladder: list[str]) -> list[str]:
    """Returns the ladder unchanged. Raises BadField if it is invalid."""
    if not any(set(ladder) <= set(known) for known in LADDERS):
        ladders = " or ".join(", ".join(known) for known in LADDERS)
        raise BadField(f"modes of one autopilot only: {ladders}")
    if len(set(ladder)) != len(ladder):
        raise BadField("each mode once")
    if any(mode in ALTITUDE_HOLDS for mode in ladder[:-1]):
        raise BadField("altitude hold needs nothing that can fail, so it comes last")
    return ladder


def settings_from(chosen: dict[str, Any]) -> DroneSettings:
    """Returns the defaults, overridden by the chosen values. Ignores values of older versions that this one does not
    know.

    Raises BadDroneSettings if the combination is invalid.
    """
    safety = {name: value for name, value in chosen.items() if name in _SAFETY_NAMES}
    if "hold_ladder" in safety:
        safety["hold_ladder"] = tuple(safety["hold_ladder"])
    if "lost_action" in safety:
        name = safety["lost_action"]
        safety["lost_action"] = LostAction(_RENAMED.get(name, name))
    stream = StreamSettings(profile=StreamChoice(chosen.get("stream_profile", StreamChoice.AUTO)))
    settings = DroneSettings(safety=SafetySettings(**safety), stream=stream)
    if settings.safety.lost_action_s < settings.safety.lost_hold_s:
        raise BadDroneSettings("the action after a loss cannot come before the hold: lost_action_s >= lost_hold_s")
    return settings
