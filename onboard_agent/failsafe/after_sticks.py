"""What the autopilot does when sticks stop, by flight mode, receiver and parameters. Pure.

Measured on ArduCopter (docs/control.md). Without a receiver the end of our sticks is a radio failsafe, about 1 s after
the last one, in every mode, except for what the options exclude: the profile has that rule. With a receiver its own
values return: they matter only in modes that use sticks, where a resting throttle makes the machine sink.
"""

from collections.abc import Callable, Mapping

from wire.autopilots import registry
from wire.open_holds import AfterSticks

AfterSticksIn = Callable[[int], AfterSticks]
"""The answer for a custom_mode."""


def after_sticks(
    autopilot_kind: int, custom_mode: int, *, values: Mapping[str, float], has_radio: bool | None
) -> AfterSticks:
    """STAYS: the mode goes on. `values`: parameters by name, as far as they are known."""
    profile = registry.multicopter(autopilot_kind)
    without = profile.flies_without_sticks(custom_mode)
    if has_radio:
        return AfterSticks.STAYS if without else AfterSticks.SINKS
    if has_radio is None:
        return AfterSticks.UNKNOWN
    return profile.family.after_sticks(custom_mode, values, without)
