"""Reads PX4's EVENT messages (MAVLink 410) about its failsafes. Pure.

PX4 sends STATUSTEXT only on a link with a ground station's heartbeat, and EVENT always. An event is a number, the hash
of a name, with packed arguments. Names and layouts: its sources, 1.16; checked on it.
"""

from struct import Struct
from typing import Final

from wire.autopilots.event_log import read_event
from wire.autopilots.failsafe_words import Failsafe, FailsafeAction, FailsafeCause

_COMPONENT: Final = 1 << 24
"""The autopilot's own events."""


def event_id(name: str) -> int:
    """The number of the event of this name."""
    value = 0x811C9DC5
    for byte in name.encode():
        value = (value ^ byte) * 0x01000193 & 0xFFFFFFFF
    return value & 0xFFFFFF | _COMPONENT


_C: Final = FailsafeCause
_A: Final = FailsafeAction
_ACTION_CAUSE: Final = Struct("<IBB")
_ACTION_DELAY_CAUSE: Final = Struct("<IBHB")
_ACTION_DELAY: Final = Struct("<IBH")
_ACTION: Final = Struct("<IB")
_ENTERED: Final[dict[int, tuple[Struct, tuple[str, ...]]]] = {
    event_id("commander_failsafe_enter"): (_ACTION_CAUSE, ("action", "cause")),
    event_id("commander_failsafe_enter_hold"): (_ACTION_DELAY_CAUSE, ("action", "delay_s", "cause")),
    event_id("commander_failsafe_enter_generic_hold"): (_ACTION_DELAY, ("action", "delay_s")),
    event_id("commander_failsafe_enter_generic"): (_ACTION, ("action",)),
    event_id("commander_failsafe_enter_autopilot_disengaged"): (_ACTION, ("action",)),
    event_id("commander_failsafe_enter_warn"): (_ACTION, ("cause",)),
    event_id("commander_failsafe_enter_generic_warn"): (Struct("<I"), ()),
    event_id("commander_failsafe_enter_low_bat"): (Struct("<"), ()),
    event_id("commander_failsafe_enter_crit_bat_warn"): (Struct("<"), ()),
    event_id("commander_failsafe_enter_crit_low_bat_warn"): (Struct("<"), ()),
    event_id("commander_failsafe_enter_low_flight_time_warn"): (Struct("<"), ()),
}
"""By event, the layout of its arguments and what follows the flight mode in them."""
_WARNS: Final = {
    event_id("commander_failsafe_enter_low_bat"): _C.LOW_BATTERY,
    event_id("commander_failsafe_enter_crit_bat_warn"): _C.CRITICAL_BATTERY,
    event_id("commander_failsafe_enter_crit_low_bat_warn"): _C.EMERGENCY_BATTERY,
    event_id("commander_failsafe_enter_low_flight_time_warn"): _C.LOW_FLIGHT_TIME,
}


def read_failsafe(frame: bytes) -> Failsafe | None:
    """The failsafe that an EVENT frame tells of; None for any other event, and for numbers that nobody knows."""
    _, (number, _, arguments) = read_event(frame)
    entered = _ENTERED.get(number)
    if entered is None:
        return None
    layout, names = entered
    told = dict(zip(names, layout.unpack_from(arguments)[1:], strict=True))
    try:
        cause = FailsafeCause(told.get("cause", _WARNS.get(number, _C.GENERIC)))
        action = FailsafeAction(told.get("action", _A.WARN))
    except ValueError:
        return None
    return Failsafe(cause, action, float(told.get("delay_s", 0)))
