"""What distinguishes one autopilot from another: modes, sticks, failsafes, commands, parameters, telemetry.

Airframe, controllers and the behaviour of flight modes are shared. `ardupilot` and `px4` define one Flavour each; no
other module may check which autopilot it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple

from simulator.behaviours import Behaviour
from simulator.command_message import UNSUPPORTED, Command
from simulator.fence import FenceLimits
from simulator.flight import Flight, OwnFailsafes
from simulator.flight_state import FlightState
from simulator.mission_plan import Item, PlanKind
from simulator.modes import ModeRules
from simulator.parameters import Parameters
from simulator.photographs import Photo
from simulator.pilot_input import PilotInput
from simulator.receiver import Receiver


class Storage(NamedTuple):
    """How plan items are stored."""

    accept: Callable[[Item, PlanKind], Item | int]
    """Returns the item as stored and read back, or the MAV_MISSION_RESULT that refuses it."""
    why_not_jump: Callable[[Item, int], int | None]
    """Takes the number of the last item of the plan."""
    why_not_whole: Callable[[Sequence[Item], PlanKind], int | None]
    """At the end of an upload."""
    fence_total: Callable[[Sequence[Item]], int] = lambda _items: 1
    """A number stored with a fence. If it becomes 0, the fence is dropped at the next check."""


@dataclass(frozen=True, slots=True)
class Flavour:
    name: str
    banner: tuple[str, ...]
    first_mode: IntEnum
    land_mode: IntEnum
    """Of a commander that ends a flight."""
    rules: Mapping[IntEnum, ModeRules]
    make_behaviours: Callable[[FlightState], dict[IntEnum, Behaviour]]
    make_parameters: Callable[[Iterable[tuple[str, float]], int], Parameters]
    make_sticks: Callable[[Parameters, Receiver], PilotInput]
    make_failsafes: Callable[[], OwnFailsafes]
    why_not_ready: Callable[[Flight], str | None]
    """Returns the first failed check before an attempt to arm."""
    why_not_arm: Callable[[Flight], str | None]
    home_slot: bool
    """Item 0 of a mission is home, not something to fly."""
    keeps_dataflash_logs: bool
    keeps_parameter_file: bool
    """MAVLink FTP serves all parameters as a file."""
    offers_metadata: bool
    """COMPONENT_METADATA is answered, unless the vehicle's settings differ."""
    storage: Storage
    items_max: Mapping[PlanKind, int]
    fence_limits: Callable[[FlightState], FenceLimits]
    """Returns the limits at present."""
    on_fence_breach: Callable[[FlightState], IntEnum | None]
    """Acts; returns the mode that must be kept until the breach is over, if any."""
    handlers: Mapping[int, Callable[[Flight, Command], int]]
    """MAV_CMD to its handler; the vehicle itself handles commands about messages and reboots."""
    reports: Mapping[int, Callable[[Flight], Any]]
    setup_reports: Mapping[int, Callable[[Flight], Any]]
    """Sent only while something is calibrated; the rate of each can be requested."""
    photo_message: Callable[[Flight, Photo], Any]
    """Returns the message for a photograph."""
    intervals_s: Mapping[int, float]
    """What is sent unrequested."""
    fixed_rates: frozenset[int]
    """Messages with a fixed rate, although a request to change it is accepted."""
    obeys_stream_requests: bool
    answers_modes_twice: bool
    """DO_SET_MODE is accepted by what receives it, and then answered."""
    reports_mode_at_once: bool
    """Each mode change sends a HEARTBEAT, in addition to one per second."""
    system_id_parameter: str
    battery_parameter: str
    accepts_any_ground_station: bool
    """Heartbeats of any ground station count, not only of the configured one."""
    signs: bool
    """Takes a key by SETUP_SIGNING, disarmed."""
    disarm_delay_s: Callable[[Flight], float]
    """Time on the ground without pilot input; 0 is never."""
    lands_with_throttle_up: bool
    """On the ground it may disarm itself although the throttle is not at its bottom."""
    set_mode_number: Callable[[Flight, int], int]
    """SET_MODE (11)."""

    def carry_out(self, flight: Flight, command: Command) -> int:
        """Returns the MAV_RESULT of a command that needs only the flight code."""
        handler = self.handlers.get(command.number)
        return handler(flight, command) if handler is not None else UNSUPPORTED
