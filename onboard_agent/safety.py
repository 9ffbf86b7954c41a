"""The safety settings that the tower sends, kept within what the agent can stand for. Pure.

The tower checks what an admin enters. Here is the last line: a wrong number must not make a drone hold all the time, or
never, or take back its pilot's sticks for an hour.
"""

from typing import Final

import msgspec

from wire.control_messages import SafetySettings

LIMITS_S: Final[dict[str, tuple[float, float]]] = {
    "hold_bound_s": (2.0, 300.0),
    "sticks_stale_s": (0.2, 10.0),
    "sticks_late_s": (0.1, 10.0),
    "commands_late_s": (0.2, 60.0),
    "lost_hold_s": (0.5, 60.0),
    "lost_action_s": (2.0, 3600.0),
}
"""Setting to its least and greatest value, in seconds."""


def within_limits(settings: SafetySettings) -> SafetySettings:
    """The settings with each time moved to the nearest one allowed; the lost action never before the hold."""
    times = {name: min(max(getattr(settings, name), least), most) for name, (least, most) in LIMITS_S.items()}
    times["lost_action_s"] = max(times["lost_action_s"], times["lost_hold_s"])
    return msgspec.structs.replace(settings, **times)
