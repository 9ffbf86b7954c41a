"""Controllers on board: the tower's request to run one, and its limits (no I/O).

Only for an agent that has sent CONTROLLERS in its hello: any other would not know the work, and close the channel.
"""

from typing import Annotated, Final

import msgspec

CONTROLLERS: Final = "controllers"
"""The entry in `takes` of a hello for this work."""

NAME_PATTERN: Final = r"^[a-z][a-z0-9_-]{0,39}$"
MIN_SPEED_M_S: Final = 0.5
MAX_SPEED_M_S: Final = 15.0
MIN_HEIGHT_M: Final = 1.0
MAX_HEIGHT_M: Final = 500.0
MIN_DISTANCE_M: Final = 5.0
MAX_DISTANCE_M: Final = 2000.0
MIN_FOR_S: Final = 5.0
MAX_FOR_S: Final = 600.0
MAX_SETTINGS: Final = 32

SETTING_PATTERN: Final = r"^[a-z][a-z0-9_]{0,39}$"

SettingName = Annotated[str, msgspec.Meta(pattern=SETTING_PATTERN)]
SettingValue = Annotated[str, msgspec.Meta(max_length=400)] | float
"""A setting of a controller: it is the controller that knows what it means, and refuses what it does not know."""


class ControllerWork(msgspec.Struct, frozen=True, tag="controller", tag_field="work"):
    """Let the controller of this name fly until something ends it; the transaction's deadline is its time.

    Heights are above home; `max_distance_m` is over ground, from where the drone is when the controller begins.
    `may_take_off`: it may arm the motors and take off; else it begins in the air only.
    """

    name: Annotated[str, msgspec.Meta(pattern=NAME_PATTERN)]
    max_speed_m_s: Annotated[float, msgspec.Meta(ge=MIN_SPEED_M_S, le=MAX_SPEED_M_S)] = 5.0
    min_height_m: Annotated[float, msgspec.Meta(ge=MIN_HEIGHT_M, le=MAX_HEIGHT_M)] = 2.0
    max_height_m: Annotated[float, msgspec.Meta(ge=MIN_HEIGHT_M, le=MAX_HEIGHT_M)] = 30.0
    max_distance_m: Annotated[float, msgspec.Meta(ge=MIN_DISTANCE_M, le=MAX_DISTANCE_M)] = 100.0
    may_take_off: bool = False
    settings: Annotated[dict[SettingName, SettingValue], msgspec.Meta(max_length=MAX_SETTINGS)] = {}
