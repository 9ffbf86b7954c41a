"""The settings of the built-in controllers. Loads none of them."""

from typing import Final

from onboard_agent.autonomy.challenge_settings import SETTINGS
from wire.controller_settings import ControllerSetting

BUILT_IN_SETTINGS: Final[dict[str, tuple[ControllerSetting, ...]]] = {"challenge": SETTINGS, "scripted": ()}
