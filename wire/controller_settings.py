"""What a controller on board says of its own settings, for the form that a person fills in (no I/O).

Only for a tower that has listed CONTROLLER_SETTINGS in its welcome: any other would not know the message, and close the
channel. Tower and agent check values by the same function, `fault_of`.
"""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from math import isfinite
from typing import Annotated, Final

import msgspec

from wire.controllers import MAX_SETTINGS, NAME_PATTERN, SettingName, SettingValue

CONTROLLER_SETTINGS: Final = "controller_settings"
"""The entry in `takes` of a welcome for this message."""

MAX_CHOICES: Final = 16
_Word = Annotated[str, msgspec.Meta(max_length=60)]


class SettingKind(StrEnum):
    """What its value is. CHOICE: one of `choices`. CAMERA: the same, and the agent fills in the names of its cameras.
    TEXT: any text; `choices` are examples."""

    NUMBER = "number"
    TEXT = "text"
    CHOICE = "choice"
    CAMERA = "camera"


class ControllerSetting(msgspec.Struct, frozen=True, kw_only=True):
    """One setting. `label`, `about`: for people, in English. `unit`: of a number, such as m, m/s or s. `characters`:
    those that a text may have; empty: any. `is_rare`: most people leave it as it is."""

    name: SettingName
    kind: SettingKind
    default: SettingValue
    label: _Word
    about: Annotated[str, msgspec.Meta(max_length=200)] = ""
    unit: Annotated[str, msgspec.Meta(max_length=12)] = ""
    least: float | None = None
    most: float | None = None
    choices: Annotated[tuple[_Word, ...], msgspec.Meta(max_length=MAX_CHOICES)] = ()
    characters: Annotated[str, msgspec.Meta(max_length=100)] = ""
    most_characters: Annotated[int, msgspec.Meta(ge=1, le=400)] = 400
    is_rare: bool = False


class ControllerDescribed(msgspec.Struct, frozen=True, tag="controller_described", tag_field="type", kw_only=True):
    """Agent to tower: the settings that this controller has, in the order of the form."""

    controller: Annotated[str, msgspec.Meta(pattern=NAME_PATTERN)]
    settings: Annotated[tuple[ControllerSetting, ...], msgspec.Meta(max_length=MAX_SETTINGS)]


def fault_of(settings: Sequence[ControllerSetting], given: Mapping[str, SettingValue]) -> tuple[str, str] | None:
    """Returns the first setting that cannot be so, and why, in words that follow its name; None if all is well."""
    known = {one.name: one for one in settings}
    for name, value in given.items():
        why = _why_not(known[name], value) if name in known else "is no setting of this controller"
        if why:
            return name, why
    return None


def _why_not(setting: ControllerSetting, value: SettingValue) -> str:
    if setting.kind is SettingKind.NUMBER:
        return _why_no_number(setting, value)
    if not isinstance(value, str):
        return "must be a text"
    if setting.kind is SettingKind.TEXT:
        if len(value) > setting.most_characters:
            return f"must have at most {setting.most_characters:d} characters"
        if setting.characters and not set(value) <= set(setting.characters):
            return f"must be made of these characters: {setting.characters}"
    elif setting.choices and value not in setting.choices:
        return f"must be one of: {', '.join(one for one in setting.choices if one)}"
    return ""


def _why_no_number(setting: ControllerSetting, value: SettingValue) -> str:
    if isinstance(value, str) or not isfinite(value):
        return "must be a number"
    least, most = setting.least, setting.most
    if (least is None or value >= least) and (most is None or value <= most):
        return ""
    unit = f" {setting.unit}" if setting.unit else ""
    if least is None:
        return f"must be at most {most:g}{unit}"
    return f"must be at least {least:g}{unit}" if most is None else f"must be from {least:g} to {most:g}{unit}"
