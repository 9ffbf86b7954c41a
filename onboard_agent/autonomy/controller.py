"""What the author of a controller needs: the base class, the directions, and what a controller sees."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, ClassVar

from onboard_agent.autonomy.core.directions import (
    Direction,
    Drop,
    Finish,
    GoBy,
    GoTo,
    Hold,
    Land,
    Move,
    TakeOff,
    Turn,
    forward,
    left,
    up,
)
from onboard_agent.autonomy.core.lines import DirectionState, Found, Seen, SetUp, VideoBox, Waypoint
from wire.controller_settings import ControllerSetting, SettingKind

if TYPE_CHECKING:
    from onboard_agent.autonomy.cameras import ControllerCameras

__all__ = [
    "Controller",
    "ControllerSetting",
    "Direction",
    "DirectionState",
    "Drop",
    "Finish",
    "Found",
    "GoBy",
    "GoTo",
    "Hold",
    "Land",
    "Move",
    "Seen",
    "SetUp",
    "SettingKind",
    "TakeOff",
    "Turn",
    "VideoBox",
    "Waypoint",
    "forward",
    "left",
    "up",
]


class Controller(ABC):
    """Flies the drone by the directions that `step` returns. It is made without arguments."""

    described_settings: ClassVar[Sequence[ControllerSetting] | None] = None
    """The settings of a request that it takes, for the console's form. They are checked before `begin`, which gets each
    one, those that nobody gave with their defaults. None: it takes what it likes, and checks that itself."""

    beat: Callable[[], None]
    """Call it at least every 0.3 s in a step that takes longer: a controller without a sign of life for 0.4 s of
    its own time is ended, and the drone holds."""

    cameras: "ControllerCameras"
    """The cameras of the agent's setting `controller_cameras`. They open at the first use."""

    report: Callable[[Found], None]
    """Tells the tower, and everybody who watches the drone, what was found."""

    note: Callable[[str, bool], None]
    """Shows words as the controller's status; with True everybody who watches the drone gets them as STATUSTEXT too."""

    def begin(self, limits: SetUp) -> None:  # noqa: B027 (most controllers need none)
        """Called once, before the first step. Load models and open devices here: it may take 15 s with the import."""

    @abstractmethod
    def step(self, seen: Seen) -> Direction | None:
        """Called ten times a second with the newest telemetry. Returns a new direction, which replaces the one before;
        None: go on."""
