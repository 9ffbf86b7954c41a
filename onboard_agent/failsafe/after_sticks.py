"""What the autopilot does when sticks stop, by flight mode, receiver and parameters. Pure.

Measured on ArduCopter (docs/control.md). Without a receiver, the end of the agent's sticks causes a radio failsafe
about 1 s after the last one, in every mode that the options do not except; the profile defines that rule. With a
receiver, its own values return. They matter only in modes that use sticks, where a resting throttle makes the drone
sink.

While sticks are in force on ArduCopter, they hide a lost transmitter. With a receiver both rules then apply.
"""

from collections.abc import Callable, Mapping

from wire.autopilots import registry
from wire.open_holds import AfterSticks

AfterSticksIn = Callable[[int], AfterSticks]
"""Maps a custom_mode to what happens when sticks stop."""


def after_sticks(
    autopilot_kind: int, custom_mode: int, *, values: Mapping[str, float], has_radio: bool | None, hidden: bool = False
) -> AfterSticks:
    """Returns STAYS if the mode continues. `values`: the known parameters by name.

    `hidden`: sticks hide whether the receiver still receives its transmitter.
    """
    profile = registry.multicopter(autopilot_kind)
    without = profile.flies_without_sticks(custom_mode)
    if has_radio and not profile.family.uses_receiver(values):
        has_radio = False
    if has_radio and not without:
        return AfterSticks.SINKS
    if has_radio and hidden:
        lost = profile.family.after_sticks(custom_mode, values, without)
        return lost if lost is AfterSticks.STAYS else AfterSticks.UNKNOWN
    if has_radio:
        return AfterSticks.STAYS
    if has_radio is None:
        return AfterSticks.UNKNOWN
    return profile.family.after_sticks(custom_mode, values, without)
