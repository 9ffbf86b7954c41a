"""The types of an autopilot's profile: its flight modes, which of them does what, and how it is commanded. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Final

from wire.autopilots.commands import (
    ChangeMode,
    CommandStep,
    CommandTable,
    NotSupported,
    PilotCommand,
    Steps,
    Unable,
    UnknownMode,
    VehicleState,
)
from wire.dialect import mavlink
from wire.open_holds import AfterSticks
from wire.plan_fields import KeptFields
from wire.transactions import CommandWork

_CUSTOM_MODE: Final = 1.0
"""param1 of DO_SET_MODE: MAV_MODE_FLAG_CUSTOM_MODE_ENABLED."""


class Sticks(StrEnum):
    """What sticks do in a flight mode."""

    FLY = "fly"
    """The sticks fly it: without a pilot it does what a radio at rest says. The safe assumption for an unknown mode."""
    ADJUST = "adjust"
    """It flies by itself, and the sticks change height or position."""
    IGNORED = "ignored"


class FlightTask(StrEnum):
    """What a flying drone does in a mode, as far as the loss of a person is concerned."""

    MISSION = "mission"
    RETURN = "return"
    LANDING = "landing"
    BY_HAND = "by-hand"
    BY_ITSELF = "by-itself"


@dataclass(frozen=True)
class FlightMode:
    """How to ask for a mode, the custom_mode by which a heartbeat shows it, and what the drone does in it."""

    name: str
    """As the autopilot names it: `ALT_HOLD`, `AUTO.LOITER`."""
    custom_mode: int
    command_parameters: tuple[float, float]
    """param2 and param3 of MAV_CMD_DO_SET_MODE."""
    label: str
    """For people."""
    aliases: tuple[str, ...] = ()
    """Other names for requests."""
    sticks: Sticks = Sticks.FLY
    task: FlightTask | None = None
    """None: not known for this mode."""
    needs_position: bool = True
    """Armed, it can only be entered and kept with a position estimate."""
    holds_when_centred: bool = False
    """Centred sticks keep level and height."""
    drifts: bool = False
    """Keeps the height and not the place."""
    flies_mission: bool = False
    """The autopilot flies its mission in it."""
    settable: bool = True
    """Whether users can request it."""
    offered: bool = False
    """Whether the console offers it for choice."""


@dataclass(frozen=True)
class ModeRoles:
    """Which mode does what a pilot asks for. None: this autopilot has none, or none that we ask for."""

    hold: FlightMode | None = None
    """Stays in place without sticks.

    Not altitude hold: without a stream of centred sticks that falls back to the radio's values, and with the throttle
    at rest the drone descends into the ground (measured).
    """
    returns: FlightMode | None = None
    land: FlightMode | None = None
    mission: FlightMode | None = None
    guided: FlightMode | None = None
    """Must be entered before it takes off and flies to places by command."""
    targets: FlightMode | None = None
    """Takes targets one after the other, for following."""
    by_hand: FlightMode | None = None
    """Obeys the sticks, and stays in place when they are centred."""


@dataclass(frozen=True)
class FailsafeModes:
    """Modes that the agent requests by itself, to hold or after a loss. Measured before they are listed."""

    position_holds: tuple[FlightMode, ...]
    """Stage one of a hold: the ladder, without its last rung."""
    altitude_hold: FlightMode
    """The last rung of every ladder."""
    going_home: tuple[FlightMode, ...]
    """Modes that end on the ground by themselves; nothing is added to them."""
    return_: FlightMode
    land: FlightMode
    mission: FlightMode
    pauses: tuple[FlightMode, ...]
    """Stage two: modes that stop a mission in the air and keep the place, without sticks."""

    @property
    def ladder(self) -> tuple[FlightMode, ...]:
        """Every rung that a drone of this kind can have, altitude hold last."""
        return (*self.position_holds, self.altitude_hold)


AfterSticksRule = Callable[[int, Mapping[str, float], bool], AfterSticks]
"""(custom_mode, parameters by name, whether the mode flies without sticks) -> what it does without a receiver."""


@dataclass(frozen=True, kw_only=True)
class AutopilotFamily:
    """What all vehicles of one MAV_AUTOPILOT have in common."""

    autopilot: int
    """MAV_AUTOPILOT."""
    name: str
    """`ardupilot`, `px4`: as agent, tower and console tell each other."""
    label: str
    main_of: Callable[[int], int]
    """The main mode in a custom_mode."""
    custom_mode: Callable[[float, float], int]
    """As its heartbeat packs param2 and param3 of DO_SET_MODE. Raises ValueError, OverflowError: no number."""
    reads_frames: bool
    """Commands: it reads an altitude in the frame of the message. Else above the sea, whatever the frame."""
    zero_is_here: bool
    """Latitude and longitude 0 are where it is; else a place off Africa."""
    has_home_slot: bool
    """Item 0 of its mission is home."""
    targets_by_command: bool
    """It takes targets as commands with an answer, one a second; else as a stream of position targets."""
    bytes_in_parameters: bool
    """It copies the bytes of an integer parameter into the float; else it casts the number."""
    packs_parameters: bool
    """All parameters lie in one file that it serves by MAVLink FTP."""
    arms_with_throttle_down: bool
    """Without a receiver it arms only while sticks show it a throttle at the bottom."""
    silent_without_receiver: bool
    """It sends no RC_CHANNELS where there is no receiver."""
    accepts_modes_it_does_not_enter: bool = False
    """A mode flown with sticks and requested with the very first sticks is accepted but not entered, until it is
    requested again."""
    station_parameters: tuple[str, ...] = ()
    """Names of the parameter that selects whose sticks it obeys."""
    stick_parameters: tuple[str, ...] = ()
    """Read besides: the middles of the stick channels."""
    loss_parameters: tuple[str, ...]
    """Those that decide what happens on a loss, and by which a simulated one is known."""
    deciding_parameters: tuple[str, ...]
    """Those that every autopilot of the family has, and without which its behaviour is unknown."""
    after_sticks: AfterSticksRule
    keeping: Callable[[int], KeptFields]
    """What it keeps of a plan's items, by MAV_TYPE."""


@dataclass(frozen=True, kw_only=True)
class AutopilotProfile:
    """One autopilot on one kind of vehicle."""

    key: str
    """Unique: `arducopter`."""
    label: str
    family: AutopilotFamily
    vehicle_types: frozenset[int]
    """MAV_TYPE."""
    modes: tuple[FlightMode, ...]
    roles: ModeRoles
    commands: CommandTable
    failsafe: FailsafeModes | None = None
    """None: the agent never changes modes by itself."""
    stands_in: bool = False
    """For naming modes of vehicles of its family that have no profile of their own."""

    @cached_property
    def _by_number(self) -> Mapping[int, FlightMode]:
        return {mode.custom_mode: mode for mode in self.modes}

    @property
    def _settable(self) -> tuple[FlightMode, ...]:
        """What an unknown sub mode is judged by. PX4's orbit, a sub mode of POSCTL, is nothing like the others."""
        return tuple(mode for mode in self.modes if mode.settable)

    @cached_property
    def _mains_when_centred(self) -> frozenset[int]:
        return frozenset(self.family.main_of(mode.custom_mode) for mode in self._settable if mode.holds_when_centred)

    @cached_property
    def _mains_without_sticks(self) -> frozenset[int]:
        return frozenset(
            self.family.main_of(mode.custom_mode) for mode in self._settable if mode.sticks is not Sticks.FLY
        )

    @cached_property
    def mission_numbers(self) -> frozenset[int]:
        """Each custom_mode in which it flies its mission."""
        return frozenset(mode.custom_mode for mode in self.modes if mode.flies_mission)

    def mode(self, custom_mode: int) -> FlightMode | None:
        """The mode that a heartbeat shows."""
        return self._by_number.get(custom_mode)

    def mode_name(self, custom_mode: int) -> str:
        """The autopilot's name for it; "mode 99" for an unknown one."""
        mode = self._by_number.get(custom_mode)
        return f"mode {custom_mode}" if mode is None else mode.name

    def flies_without_sticks(self, custom_mode: int) -> bool:
        """Whether the mode needs no pilot at the sticks. An unknown mode counts as one that does."""
        mode = self.mode(custom_mode)
        if mode is not None:
            return mode.sticks is not Sticks.FLY
        return self.family.main_of(custom_mode) in self._mains_without_sticks

    def holds_when_centred(self, custom_mode: int) -> bool:
        """Whether this is a mode of sticks in which centred ones keep level and height. Unknown modes are none."""
        mode = self.mode(custom_mode)
        if mode is not None:
            return mode.holds_when_centred
        return self.family.main_of(custom_mode) in self._mains_when_centred

    def steps(self, state: VehicleState, command: PilotCommand) -> Steps:
        """What a command becomes. Raises CommandRefused."""
        said = getattr(self.commands, command.name)
        if isinstance(said, Unable):
            raise NotSupported(f"{state.name} flies {self.label}, which {said.which}")
        steps: Steps = said(state, command)
        return steps

    def why_not(self, name: str) -> str | None:
        """Why it never does the command of this name, as a sentence; None: it does."""
        said = getattr(self.commands, name)
        return f"{self.label} {said.which}" if isinstance(said, Unable) else None


def mode_step(mode: FlightMode, state: VehicleState | None = None) -> CommandStep:
    """Into a mode. With a `state`: needless where it is in it already."""
    main, sub = mode.command_parameters
    work = CommandWork(int(mavlink.MAV_CMD_DO_SET_MODE), (_CUSTOM_MODE, main, sub, 0.0, 0.0, 0.0, 0.0))
    is_there = state is not None and state.custom_mode == mode.custom_mode
    return CommandStep(f"changing to {mode.name}", work, needless=is_there)


def mode_named(modes: Sequence[FlightMode], name: str) -> FlightMode | None:
    """A mode that users can request. Ignores case, spaces and hyphens."""
    wanted = "_".join(name.upper().replace("_", " ").split())
    return next((mode for mode in modes if mode.settable and wanted in (mode.name, *mode.aliases)), None)


def change_mode(modes: Sequence[FlightMode]) -> Callable[[VehicleState, ChangeMode], Steps]:
    """For a CommandTable: any mode that users can request."""

    def say(state: VehicleState, command: ChangeMode) -> Steps:
        mode = mode_named(modes, command.mode)
        if mode is None:
            known = ", ".join(one.name for one in modes if one.settable)
            raise UnknownMode(f"{state.name} has no such mode; it has {known}")
        return (mode_step(mode),)

    return say


def into(mode: FlightMode) -> Callable[[VehicleState, PilotCommand], Steps]:
    """For a CommandTable: always into this mode."""
    return lambda state, command: (mode_step(mode),)
