"""A request's values for the settings that a controller describes, checked by them. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import msgspec

from onboard_agent.autonomy.core.lines import CameraSetting, SetUp
from wire.controller_settings import ControllerSetting, SettingKind, fault_of


class BadSetting(ValueError):
    """One line for people."""


def with_cameras(
    settings: Iterable[ControllerSetting], cameras: Sequence[CameraSetting]
) -> tuple[ControllerSetting, ...]:
    """Returns them with the names of the cameras to choose from; empty: the first one."""
    names = ("", *(one.name for one in cameras))
    return tuple(
        msgspec.structs.replace(one, choices=names) if one.kind is SettingKind.CAMERA else one for one in settings
    )


def with_settings(set_up: SetUp, described: Sequence[ControllerSetting] | None) -> SetUp:
    """Returns it with a value for each described setting. Raises BadSetting."""
    if described is None:
        return set_up
    fault = fault_of(with_cameras(described, set_up.cameras), set_up.settings)
    if fault is not None:
        raise BadSetting(": ".join(fault))
    return msgspec.structs.replace(set_up, settings={one.name: one.default for one in described} | set_up.settings)
