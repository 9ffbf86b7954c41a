"""A pilot's commands as plain values, and their MAVLink form. Pure.

Each autopilot's profile has a `CommandTable`: for each command its form, or why it is not available.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Final, Generic, TypeVar

from wire.dialect import mavlink
from wire.transactions import CommandWork

FORCE_DISARM: Final = 21196.0
"""param2 of MAV_CMD_COMPONENT_ARM_DISARM by which ArduPilot and PX4 disarm whatever the drone is doing."""


class CommandRefused(Exception):
    """The command becomes nothing for this vehicle. The message is a sentence for people that names the drone."""


class NotSupported(CommandRefused):
    """This autopilot lacks the command, or its form is not known."""


class NotHeardYet(CommandRefused):
    """The drone has not reported something that the command needs."""


class UnknownMode(CommandRefused):
    """The vehicle's autopilot."""


class UnknownItem(CommandRefused):
    """Beyond the plan that is on board."""


@dataclass(frozen=True)
class PilotCommand:
    """Degrees, metres above home, metres a second."""

    name: ClassVar[str]
    """The field of `CommandTable`."""


@dataclass(frozen=True)
class Arm(PilotCommand):
    name = "arm"


@dataclass(frozen=True)
class Disarm(PilotCommand):
    """`force`: also in the air, where the drone falls."""

    name = "disarm"
    force: bool = False


@dataclass(frozen=True)
class ChangeMode(PilotCommand):
    name = "mode"
    mode: str


@dataclass(frozen=True)
class TakeOff(PilotCommand):
    """Changes to a suitable mode, arms if necessary, and takes off."""

    name = "takeoff"
    height_m: float


@dataclass(frozen=True)
class GoTo(PilotCommand):
    """`heading_deg`: which way it looks, clockwise from north; None: the autopilot's own rule holds."""

    name = "goto"
    lat_deg: float
    lon_deg: float
    height_m: float
    speed_m_s: float | None = None
    heading_deg: float | None = None


@dataclass(frozen=True)
class Hold(PilotCommand):
    """Stays in place without sticks."""

    name = "hold"


@dataclass(frozen=True)
class Pause(PilotCommand):
    name = "pause"


@dataclass(frozen=True)
class Resume(PilotCommand):
    """Goes on with what was paused, else the mission."""

    name = "resume"


@dataclass(frozen=True)
class Land(PilotCommand):
    name = "land"


@dataclass(frozen=True)
class Return(PilotCommand):
    """To where home is, by the autopilot's own rule, and down."""

    name = "rtl"


@dataclass(frozen=True)
class ChangeSpeed(PilotCommand):
    """Over ground."""

    name = "speed"
    m_s: float


@dataclass(frozen=True)
class Turn(PilotCommand):
    """Turns to a heading; `relative`: by this angle, clockwise."""

    name = "turn"
    deg: float
    relative: bool = False


@dataclass(frozen=True)
class SetHome(PilotCommand):
    """`place_deg`: latitude and longitude; None: where it is. `altitude_m`: above the sea; None: as high as the present
    home, but for a drone on the ground that makes its own place home."""

    name = "set_home"
    place_deg: tuple[float, float] | None = None
    altitude_m: float | None = None


@dataclass(frozen=True)
class StartMission(PilotCommand):
    """From this item on, counted from 0 without home; armed if it is not yet."""

    name = "start"
    item: int = 0


@dataclass(frozen=True)
class Jump(PilotCommand):
    """To this item of the mission that it flies."""

    name = "jump"
    item: int


@dataclass(frozen=True)
class Orbit(PilotCommand):
    """`radius_m` negative: counter-clockwise."""

    name = "orbit"
    lat_deg: float
    lon_deg: float
    radius_m: float
    height_m: float
    m_s: float | None = None


@dataclass(frozen=True)
class LookAt(PilotCommand):
    """`place`: latitude, longitude, height above home; None: ahead again."""

    name = "roi"
    place: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class CommandStep:
    """One MAV_CMD. `phase`: what it does, for people. `needless`: its effect is already present."""

    phase: str
    work: CommandWork
    needless: bool = False


@dataclass(frozen=True)
class VehicleState:
    """What is known of the vehicle that a command is for, at this moment. None: not known."""

    name: str
    """The drone's, for sentences."""
    custom_mode: int
    """As its heartbeat shows it."""
    armed: bool | None = None
    airborne: bool | None = None
    home_alt_m: float | None = None
    """Above the sea."""
    place_deg: tuple[float, float] | None = None
    """Latitude and longitude."""
    height_m: float | None = None
    """Above home."""
    heading_deg: float | None = None
    mission_items: int | None = None
    """None: the plan on board is not known."""

    def is_armed(self) -> bool:
        """Raises NotHeardYet: a command that arms does not start in an unknown state."""
        if self.armed is None:
            raise NotHeardYet(f"it is not known whether {self.name} is armed: its autopilot is silent")
        return self.armed

    def here(self) -> tuple[float, float]:
        """Latitude and longitude. Raises NotHeardYet."""
        if self.place_deg is None:
            raise NotHeardYet(f"the position of {self.name} is not known yet")
        return self.place_deg

    def height(self) -> float:
        """Above home. Raises NotHeardYet."""
        if self.height_m is None:
            raise NotHeardYet(f"the height of {self.name} is not known yet")
        return self.height_m

    def heading(self) -> float:
        """Clockwise from north. Raises NotHeardYet."""
        if self.heading_deg is None:
            raise NotHeardYet(f"the heading of {self.name} is not known yet")
        return self.heading_deg

    def above_sea(self, height_m: float) -> float:
        """Converts a height above home. Raises NotHeardYet."""
        if self.home_alt_m is None:
            raise NotHeardYet(f"the home of {self.name} is not known yet")
        return self.home_alt_m + height_m

    def check_item(self, item: int) -> None:
        """Raises UnknownItem of one beyond the mission on board, where that is known."""
        if self.mission_items is not None and item >= self.mission_items:
            count = self.mission_items
            there = f"the mission on board has {count} items" if count else "no mission is on board"
            raise UnknownItem(f"{self.name} has no item {item + 1}: {there}")


Steps = tuple[CommandStep, ...]
"""One after the other, up to the first that is not accepted. At least one; the last is never needless."""

C_contra = TypeVar("C_contra", bound=PilotCommand, contravariant=True)


@dataclass(frozen=True)
class Unable(Generic[C_contra]):
    """Why the autopilot cannot do it: what follows "ArduCopter, which"."""

    which: str


Said = Callable[[VehicleState, C_contra], Steps] | Unable[C_contra]
"""The form of a command. Raises CommandRefused if this vehicle cannot be given it now."""


@dataclass(frozen=True, kw_only=True)
class CommandTable:
    """One field for each command, by its name."""

    arm: Said[Arm]
    disarm: Said[Disarm]
    mode: Said[ChangeMode]
    takeoff: Said[TakeOff]
    goto: Said[GoTo]
    hold: Said[Hold]
    pause: Said[Pause]
    resume: Said[Resume]
    land: Said[Land]
    rtl: Said[Return]
    speed: Said[ChangeSpeed]
    turn: Said[Turn]
    set_home: Said[SetHome]
    start: Said[StartMission]
    jump: Said[Jump]
    orbit: Said[Orbit]
    roi: Said[LookAt]


_BESIDE: Final = (Arm, ChangeSpeed, LookAt, SetHome, Turn)
"""Does not change how the drone flies, unless combined with a command that does."""
_FLIES: Final = frozenset({int(mavlink.MAV_CMD_DO_REPOSITION), int(mavlink.MAV_CMD_DO_SET_MODE)})


def overrules(command: PilotCommand, steps: Steps) -> bool:
    """Whether it decides how the drone flies: no earlier command may follow it."""
    return not isinstance(command, _BESIDE) or any(step.work.command in _FLIES for step in steps)
