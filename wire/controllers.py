"""Controllers on board: the tower's request to run one, and its limits (no I/O).

Only for an agent that has sent CONTROLLERS in its hello: any other would not know the work, and close the channel.
"""

import re
from collections.abc import Iterable
from typing import Annotated, Final

import msgspec

CONTROLLERS: Final = "controllers"
"""The entry in `takes` of a hello for this work."""

_OFFER: Final = "controller:"
_MAX_TAKE: Final = 40
"""Characters of an entry in `takes`."""
MAX_OFFERED: Final = 16

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


def offers(names: Iterable[str]) -> tuple[str, ...]:
    """Returns the entries in `takes` of a hello that name the agent's controllers. A name that is none, or too long for
    an entry, is left out, as are those above MAX_OFFERED: they can be started, but are in no list."""
    entries = [_OFFER + name for name in names if re.fullmatch(NAME_PATTERN, name)]
    return tuple([entry for entry in entries if len(entry) <= _MAX_TAKE][:MAX_OFFERED])


def offered(takes: Iterable[str]) -> list[str]:
    """Returns the names that the entries of `offers` have, in order; empty for an agent that told none."""
    names = (entry.removeprefix(_OFFER) for entry in takes if entry.startswith(_OFFER))
    return sorted(name for name in names if re.fullmatch(NAME_PATTERN, name))
