"""What the controllers of one drone say of their settings, and whether values are good. No I/O."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from server.kernel.refusal import Refusal
from wire.controller_settings import ControllerDescribed, ControllerSetting, fault_of
from wire.controllers import MAX_OFFERED, SettingValue


class BadControllerSetting(Refusal):
    """`field`: of the request's body."""

    def __init__(self, setting: str, why: str) -> None:
        super().__init__(why)
        self.field = f"settings.{setting}"


class ControllerForms:
    """As the agent told on its present link. A controller that it did not describe takes any settings."""

    def __init__(self) -> None:
        self._settings: dict[str, tuple[ControllerSetting, ...]] = {}

    def described(self, message: ControllerDescribed) -> None:
        """Keeps the newest description of each, at most MAX_OFFERED."""
        if message.controller in self._settings or len(self._settings) < MAX_OFFERED:
            self._settings[message.controller] = message.settings

    def forget(self) -> None:
        """Another agent may have others."""
        self._settings.clear()

    def of(self, controller: str) -> Sequence[ControllerSetting] | None:
        """Returns its settings in order; None: it was not described."""
        return self._settings.get(controller)

    def check(self, controller: str, given: Mapping[str, SettingValue]) -> None:
        """Raises BadControllerSetting for the first value that the controller would refuse."""
        settings = self._settings.get(controller)
        fault = fault_of(settings, given) if settings is not None else None
        if fault is not None:
            raise BadControllerSetting(*fault)
