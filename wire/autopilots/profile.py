"""The types of an autopilot's profile: its flight modes, their roles, and its commands. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Final, Protocol

from wire.autopilots.commands import (
    ChangeMode,
    CommandStep,
    CommandTable,
    NotSupported,
    Steps,
    Unable,
    UnknownMode,
    VehicleState,
)
from wire.autopilots.failsafe_words import Failsafe
from wire.autopilots.loss_sentence import Sentence
from wire.autopilots.own_fence import OwnFence
from wire.autopilots.pilot_command import PilotCommand
from wire.autopilots.wanted_parameter import WantedParameter
from wire.control_messages import LossParameters, SafetySettings
from wire.dialect import mavlink
from wire.firmware import Release, release_of
from wire.open_holds import AfterSticks, LostAction
from wire.plan_fields import KeptFields
from wire.transactions import CommandWork

_CUSTOM_MODE: Final = 1.0
"""param1 of DO_SET_MODE: MAV_MODE_FLAG_CUSTOM_MODE_ENABLED."""


class Sticks(StrEnum):
    """What the sticks do in a flight mode."""

    FLY = "fly"
    """The sticks fly the drone: without a pilot it obeys the resting radio. The safe assumption for an unknown mode."""
    CLIMB = "climb"
    """The mode flies its way by itself, and the throttle climbs and descends: a resting radio sinks it to the ground.
    """
    ADJUST = "adjust"
    """The mode flies by itself and keeps its height; the sticks change the way."""
    IGNORED = "ignored"


_NEED_A_HAND: Final = (Sticks.FLY, Sticks.CLIMB)


class FlightTask(StrEnum):
    """What an airborne drone does in a mode, as far as loss handling is concerned."""

    MISSION = "mission"
    RETURN = "return"
    LANDING = "landing"
    BY_HAND = "by-hand"
    BY_ITSELF = "by-itself"


@dataclass(frozen=True)
class FlightMode:
    """How to request a mode, the custom_mode that a heartbeat reports for it, and what the drone does in it."""

    name: str
    """The autopilot's name: `ALT_HOLD`, `AUTO.LOITER`."""
    custom_mode: int
    command_parameters: tuple[float, float]
    """param2 and param3 of MAV_CMD_DO_SET_MODE."""
    label: str
    """For people."""
    aliases: tuple[str, ...] = ()
    """Further names accepted in requests."""
    sticks: Sticks = Sticks.FLY
    task: FlightTask | None = None
    """None: not defined for this mode."""
    needs_position: bool = True
    """An armed drone can enter and keep it only with a position estimate."""
    holds_when_centred: bool = False
    """Centred sticks keep the drone level and at its height."""
    drifts: bool = False
    """Keeps the height but not the position."""
    flies_mission: bool = False
    """The autopilot flies its mission in this mode."""
    settable: bool = True
    """Whether it may be requested."""
    offered: bool = False
    """Whether the console offers it."""


@dataclass(frozen=True)
class ModeRoles:
    """Which mode does what a pilot requests. None: this autopilot has no such mode, or we request none."""

    hold: FlightMode | None = None
    """Holds position without sticks. Not altitude hold: without a stream of centred sticks that mode falls back to the
    radio's values, and with the throttle at rest the drone descends into the ground (measured)."""
    returns: FlightMode | None = None
    land: FlightMode | None = None
    mission: FlightMode | None = None
    guided: FlightMode | None = None
    """Must be entered before take-off and before flights to positions by command."""
    targets: FlightMode | None = None
    """Accepts successive targets, for following."""
    setpoints: FlightMode | None = None
    """Obeys a stream of velocities and positions (SET_POSITION_TARGET_*), for controllers on board."""
    by_hand: FlightMode | None = None
    """Obeys the sticks, and holds position when they are centred."""


@dataclass(frozen=True)
class FailsafeModes:
    """The modes that the agent requests by itself for a hold or a loss. Added only after measurement."""

    position_holds: tuple[FlightMode, ...]
    """Stage one of a hold: the ladder, without its last rung."""
    altitude_hold: FlightMode
    """The last rung of every ladder."""
    going_home: tuple[FlightMode, ...]
    """Modes that end on the ground by themselves; the agent does not interfere with them."""
    return_: FlightMode
    land: FlightMode
    mission: FlightMode
    pauses: tuple[FlightMode, ...]
    """Stage two: modes that stop a mission in the air and hold position, without sticks."""

    @property
    def ladder(self) -> tuple[FlightMode, ...]:
        """Every rung available to this kind of drone, altitude hold last."""
        return (*self.position_holds, self.altitude_hold)


AfterSticksRule = Callable[[int, Mapping[str, float], bool], AfterSticks]
"""(custom_mode, parameters by name, whether the mode flies without sticks) -> what the drone does without a receiver.
"""

LossSentences = Callable[[LossParameters, SafetySettings], Iterable[Sentence]]
"""What it does on a loss, from its parameters, in words."""


def _never_proved(values: Mapping[str, float]) -> bool:
    return False


def _no_fence(values: Mapping[str, float], is_on: bool | None) -> OwnFence | None:
    return None


def _does_nothing(values: Mapping[str, float], number: int, mission_is_over: bool) -> None:
    return None


def _not_known(values: Mapping[str, float]) -> int | None:
    return None


def _ignores_none(values: Mapping[str, float], has_radio: bool | None) -> bool:
    return False


def _uses_receiver(values: Mapping[str, float]) -> bool:
    return True


def _no_failsafe(frame: bytes) -> Failsafe | None:
    return None


def _settled(values: Mapping[str, float]) -> float:
    return 0.0


class ArmingChecks(Protocol):
    """Why an autopilot does not arm."""

    def take(self, frame: bytes) -> bool:
        """Takes an EVENT frame. Whether it is new: one that was missed comes late, and some come twice."""

    def reasons(self, custom_mode: int) -> tuple[str, ...]:
        """Why it does not arm in this flight mode."""

    @property
    def fence_breach(self) -> str | None:
        """Which limit of its fence is broken; empty: none; None: not known."""


@dataclass(frozen=True, kw_only=True)
class AutopilotFamily:
    """What all vehicles of one MAV_AUTOPILOT have in common."""

    autopilot: int
    """MAV_AUTOPILOT."""
    name: str
    """`ardupilot`, `px4`: the name that agent, tower and console exchange."""
    label: str
    main_of: Callable[[int], int]
    """Returns the main mode in a custom_mode."""
    custom_mode: Callable[[float, float], int]
    """Packs param2 and param3 of DO_SET_MODE as the heartbeat does. Raises ValueError or OverflowError for NaN or
    infinity."""
    reads_frames: bool
    """Commands: it reads an altitude in the frame of the message. Else above sea level, whatever the frame."""
    zero_is_here: bool
    """Latitude and longitude 0 mean the current position; else a position off Africa."""
    has_home_slot: bool
    """Item 0 of its mission is home."""
    targets_by_command: bool
    """It accepts targets as acknowledged commands, one per second; else as a stream of position targets."""
    bytes_in_parameters: bool
    """It copies the bytes of an integer parameter into the float; else it casts the number."""
    packs_parameters: bool
    """It serves all parameters in one file over MAVLink FTP."""
    arms_with_throttle_down: bool
    """Without a receiver it arms only while the sticks report the throttle at the bottom."""
    silent_without_receiver: bool
    """It sends no RC_CHANNELS without a receiver."""
    answers_timesync: bool = False
    """It answers TIMESYNC, by which the agent knows that it is heard."""
    ignores_sticks: Callable[[Mapping[str, float], bool | None], bool] = _ignores_none
    """(parameters by name, whether there is a radio) -> whether sticks from the tower move nothing."""
    uses_receiver: Callable[[Mapping[str, float]], bool] = _uses_receiver
    """Whether a receiver on board replaces sticks that end."""
    sticks_settle_s: Callable[[Mapping[str, float]], float] = _settled
    """How long sticks must not move before a mode without sticks is requested. Otherwise it takes the motion for a
    pilot's, and leaves that mode."""
    read_failsafe: Callable[[bytes], Failsafe | None] = _no_failsafe
    """The failsafe that an EVENT frame tells of."""
    make_checks: Callable[[], ArmingChecks] | None = None
    """Reads its arming checks from EVENT frames. None: it tells them in texts."""
    prearm_by_health: bool = False
    """SYS_STATUS: the health bit of the pre-arm check counts, although the check is not marked as enabled."""
    shows_failsafe: bool = False
    """HEARTBEAT.system_status CRITICAL means that its failsafe, and nobody's command, has chosen the mode."""
    sticks_hide_receiver: bool = False
    """While sticks are in force, it does not report whether its receiver receives a transmitter, nor acts on a loss."""
    accepts_modes_it_does_not_enter: bool = False
    """When a stick mode is requested together with the first sticks, the autopilot accepts but does not enter it; it
    enters the mode on a second request."""
    flies_on_in: frozenset[int] = frozenset()
    """Modes in which it flies to targets, and goes on with that when the mode is asked for again."""
    decides_later: bool = False
    """It accepts a target or a circle, and refuses it afterwards: by a text, or by another flight mode."""
    counts_from_last_release: bool = False
    """A development build bears the number of the release that it has grown from, not of the one to come."""
    station_parameters: tuple[str, ...] = ()
    """Names of the parameter that selects whose sticks it obeys."""
    stick_parameters: tuple[str, ...] = ()
    """Also read: the centres of the stick channels."""
    loss_parameters: tuple[str, ...]
    """The parameters that decide what happens on a loss, and those that identify a simulated autopilot."""
    deciding_parameters: tuple[str, ...]
    """The subset that every autopilot of the family has, and without which its behaviour is unknown."""
    after_sticks: AfterSticksRule
    station_lost: Callable[[Mapping[str, float], int, bool], tuple[LostAction, float] | None] = _does_nothing
    """What it does by itself without a ground station's heartbeats, and how many seconds after the last one; by its
    parameters, flight mode, and whether its mission is over. None: nothing, or not known."""
    keeping: Callable[[int, Release | None], KeptFields]
    """What it keeps of a plan's items, by MAV_TYPE and release (None: not known)."""
    loss_sentences: LossSentences | None = None
    """None: what it does on a loss is unknown."""
    without_receiver: tuple[WantedParameter, ...] = ()
    """What it needs to fly without a radio receiver."""
    with_receiver: tuple[WantedParameter, ...] = ()
    """What it needs so that it does not obey a transmitter that nobody holds when the computer on board fails."""
    is_simulated: Callable[[Mapping[str, float]], bool] = _never_proved
    """Whether these parameters prove that it is a simulation."""
    own_fence: Callable[[Mapping[str, float], bool | None], OwnFence | None] = _no_fence
    """The fence that it keeps by itself, from its parameters and whether its SYS_STATUS shows it as enabled (None: not
    heard). None: it refuses no place, or that is not known."""
    motor_count: Callable[[Mapping[str, float]], int | None] = _not_known
    """How many motors its motor test knows, from its parameters; None: not known."""
    mission_lacks: frozenset[int] = frozenset()
    """Mission commands of the planner that it does not carry out."""
    mission_hides: frozenset[int] = frozenset()
    """Mission commands that the planner does not offer: it refuses them with a position."""
    mission_requires: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    """Mission command to those of its parameters (1 to 4) that may be NaN for others and not for it."""
    looks_by_legacy_roi: bool = False
    """All its releases know DO_SET_ROI, and not all know DO_SET_ROI_LOCATION."""
    return_heights: Mapping[str, float] = field(default_factory=dict)
    """Parameters with the height of a return above home, to metres per unit: the first that it has counts."""
    arming_switches: frozenset[float] = frozenset()
    """param1 of DO_AUX_FUNCTION that arms."""
    stopping_switches: frozenset[float] = frozenset()
    """param1 of DO_AUX_FUNCTION that stops motors."""
    mission_switches: frozenset[float] = frozenset()
    """param1 of DO_AUX_FUNCTION that may start the mission."""
    arming_commands: frozenset[int] = frozenset()
    """Commands that arm beside what they are for."""
    mission_since: Mapping[int, Release] = field(default_factory=dict)
    """Mission commands that releases before this one refuse."""
    log_folders: tuple[bytes, ...] = ()
    """Where MAVLink FTP finds its flight logs: the first that exists counts."""

    def release_of(self, flight_sw_version: int) -> Release | None:
        """The newest release whose features the firmware surely has; None: not known."""
        return release_of(flight_sw_version, counts_from_last=self.counts_from_last_release)


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
    takes_centred_sticks: bool = False
    """Without `failsafe`: the agent's centred sticks replace a pilot's, because an end of sticks would be worse."""
    arming_modes: frozenset[int] = frozenset()
    """custom_mode of each mode that arms."""
    stands_in: bool = False
    """Names the modes of vehicles of its family that have no profile."""

    @property
    def is_watched_only(self) -> bool:
        """Whether the agent sends it no sticks and no mode by itself: nobody has measured what they would do."""
        return self.failsafe is None and not self.takes_centred_sticks

    @cached_property
    def _by_number(self) -> Mapping[int, FlightMode]:
        return {mode.custom_mode: mode for mode in self.modes}

    @property
    def _settable(self) -> tuple[FlightMode, ...]:
        """The modes by which an unknown sub mode is judged. PX4's orbit, a sub mode of POSCTL, is unlike the others."""
        return tuple(mode for mode in self.modes if mode.settable)

    @cached_property
    def _mains_when_centred(self) -> frozenset[int]:
        return frozenset(self.family.main_of(mode.custom_mode) for mode in self._settable if mode.holds_when_centred)

    @cached_property
    def _mains_without_sticks(self) -> frozenset[int]:
        return frozenset(
            self.family.main_of(mode.custom_mode) for mode in self._settable if mode.sticks not in _NEED_A_HAND
        )

    @cached_property
    def mission_numbers(self) -> frozenset[int]:
        """Each custom_mode in which it flies its mission."""
        return frozenset(mode.custom_mode for mode in self.modes if mode.flies_mission)

    def mode(self, custom_mode: int) -> FlightMode | None:
        """Returns the mode that a heartbeat reports."""
        return self._by_number.get(custom_mode)

    def mode_name(self, custom_mode: int) -> str:
        """Returns the autopilot's name for the mode; "mode 99" if it has none."""
        mode = self._by_number.get(custom_mode)
        return f"mode {custom_mode}" if mode is None else mode.name

    def flies_without_sticks(self, custom_mode: int) -> bool:
        """Returns whether this mode flies without sticks. An unknown mode counts as one that needs them."""
        mode = self.mode(custom_mode)
        if mode is not None:
            return mode.sticks not in _NEED_A_HAND
        return self.family.main_of(custom_mode) in self._mains_without_sticks

    def holds_when_centred(self, custom_mode: int) -> bool:
        """Returns whether centred sticks keep level and height in this stick mode. False for unknown modes."""
        mode = self.mode(custom_mode)
        if mode is not None:
            return mode.holds_when_centred
        return self.family.main_of(custom_mode) in self._mains_when_centred

    def steps(self, state: VehicleState, command: PilotCommand) -> Steps:
        """Translates a command into steps. Raises CommandRefused."""
        said = getattr(self.commands, command.name)
        if isinstance(said, Unable):
            raise NotSupported(f"{state.name} flies {self.label}, which {said.which}")
        steps: Steps = said(state, command)
        return steps

    def why_not(self, name: str) -> str | None:
        """Returns why this profile never executes the command of this name, as a sentence; None: it does."""
        said = getattr(self.commands, name)
        return f"{self.label} {said.which}" if isinstance(said, Unable) else None


def mode_step(mode: FlightMode, state: VehicleState | None = None) -> CommandStep:
    """Returns the step that enters a mode. With a `state`: needless if the drone is already in it."""
    main, sub = mode.command_parameters
    work = CommandWork(int(mavlink.MAV_CMD_DO_SET_MODE), (_CUSTOM_MODE, main, sub, 0.0, 0.0, 0.0, 0.0))
    is_there = state is not None and state.custom_mode == mode.custom_mode
    return CommandStep(f"changing to {mode.name}", work, needless=is_there)


def mode_named(modes: Sequence[FlightMode], name: str) -> FlightMode | None:
    """Finds a mode that may be requested. Case is ignored; spaces and underscores between words are equivalent."""
    wanted = "_".join(name.upper().replace("_", " ").split())
    return next((mode for mode in modes if mode.settable and wanted in (mode.name, *mode.aliases)), None)


def change_mode(modes: Sequence[FlightMode]) -> Callable[[VehicleState, ChangeMode], Steps]:
    """For a CommandTable: enters any of these modes that may be requested."""

    def say(state: VehicleState, command: ChangeMode) -> Steps:
        mode = mode_named(modes, command.mode)
        if mode is None:
            known = ", ".join(one.name for one in modes if one.settable)
            raise UnknownMode(f"{state.name} has no such mode; it has {known}")
        return (mode_step(mode),)

    return say


def into(mode: FlightMode) -> Callable[[VehicleState, PilotCommand], Steps]:
    """For a CommandTable: always enters this mode."""
    return lambda state, command: (mode_step(mode),)
