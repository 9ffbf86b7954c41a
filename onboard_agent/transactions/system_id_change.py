"""A write of the autopilot's own MAVLink system id. Pure.

ArduPilot from 4.7 on has the new id at once, so that its answer comes from a system that nobody knows; before, and
PX4, after a restart. Meanwhile that ArduPilot ignores sticks for the id under which it still sends (measured).
"""

from typing import Final

from onboard_agent.transactions.handler import Around

SYSTEM_IDS: Final = frozenset({"MAV_SYSID", "SYSID_THISMAV", "MAV_SYS_ID"})
"""ArduPilot from 4.7 on, and before; PX4."""
MAX_SYSTEM_ID: Final = 254
"""255 is that of ground stations."""
FOLLOWED_WITHIN_S: Final = 8.0
"""The agent takes another system for its own after five seconds of silence; heartbeats come once a second."""


def why_not(asked: float, around: Around) -> str | None:
    """Returns why the system id cannot become this one now, or None."""
    if not 1 <= asked <= MAX_SYSTEM_ID:
        return f"A vehicle's system id is 1 to {MAX_SYSTEM_ID}."
    if around.armed:
        return "The system id is changed on the ground only, when the drone is disarmed."
    if around.system_is_fixed:
        return f"The agent serves system {around.system_id} alone (`system_id` in its settings): change that first."
    if asked in around.other_systems:
        return f"Another autopilot on this line is system {asked:.0f}."
    return None


def words_of(asked: float, *, moved: bool) -> str:
    """Returns what else there is to say of a written system id."""
    if moved:
        return f" The autopilot is system {asked:.0f} now, and the agent follows it."
    return f" The autopilot becomes system {asked:.0f} when it restarts. Do not fly before: it may ignore sticks."
