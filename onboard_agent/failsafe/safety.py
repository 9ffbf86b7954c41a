"""Keeps the tower's safety settings within the agent's own limits. Pure.

The tower checks what an admin enters. This is the last check: a wrong number must not make a drone hold always or
never.
"""

from typing import Final

import msgspec

from wire.control_messages import SafetySettings

LIMITS: Final[dict[str, tuple[float, float]]] = {
    "sticks_stale_s": (0.2, 10.0),
    "sticks_late_s": (0.1, 10.0),
    "commands_late_s": (0.2, 60.0),
    "lost_hold_s": (0.5, 60.0),
    "lost_action_s": (2.0, 3600.0),
    "rtt_limit_ms": (50.0, 10_000.0),
    "rtt_limit_s": (0.2, 30.0),
}
"""Minimum and maximum of each setting, in seconds; `rtt_limit_ms` in milliseconds."""


def within_limits(settings: SafetySettings) -> SafetySettings:
    """Returns the settings with each number clamped to its limits, and the lost action not before the hold."""
    values = {name: min(max(getattr(settings, name), least), most) for name, (least, most) in LIMITS.items()}
    values["lost_action_s"] = max(values["lost_action_s"], values["lost_hold_s"])
    return msgspec.structs.replace(settings, **values)
