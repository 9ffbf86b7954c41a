"""State of the drone that a hold needs at a tick: plain values, gathered by `failsafe.py`."""

from dataclasses import dataclass

from onboard_agent.failsafe.after_sticks import AfterSticksIn
from wire.open_holds import AfterSticks


def _unknown(custom_mode: int) -> AfterSticks:
    return AfterSticks.UNKNOWN


@dataclass(frozen=True)
class Flying:
    """`level`, `has_position`: None if the autopilot does not report it."""

    vehicle_system_id: int = 1
    may_be_held: bool = True
    """The agent's own sticks may go to this vehicle."""
    ground_station_system_id: int = 255
    airborne: bool = True
    stands: bool = False
    """On the ground for some seconds, as the autopilot reports."""
    level: bool | None = True
    has_position: bool | None = True
    still: bool = True
    """Hardly moving over ground."""
    fast: bool = False
    """Too fast for a mode that brakes, which would overshoot."""
    sinking: bool = False
    low_and_sinking: bool = False
    """The drone would touch the ground before level sticks stop its descent."""
    by_hand: bool = False
    """The autopilot shows a mode that needs sticks."""
    by_failsafe: bool = False
    """The autopilot's own failsafe has chosen the mode that it shows, because it missed sticks."""
    ignores_sticks: bool = False
    """Sticks from the agent are known to move nothing."""
    sticks_settle_s: float = 0.0
    """How long sticks must not move before a mode without sticks is requested."""
    pilot_fresh: bool = True
    """A person's own sticks have just arrived."""
    after_sticks: AfterSticksIn = _unknown
