"""What the autopilot does by itself when sticks stop, by flight mode, receiver and parameters: a table. Pure.

Measured on ArduCopter (docs/control.md). Without a receiver the end of our sticks is a radio failsafe, about 1 s after
the last one, whatever the mode, but for what the options except. With a receiver its own values come back: they matter
only in modes that use sticks, and there a resting throttle makes the machine sink.
"""

from collections.abc import Callable, Mapping
from typing import Final

from onboard_agent.autopilot.flight_modes import flies_without_sticks, px4_custom_mode
from wire.dialect import mavlink
from wire.open_holds import AfterSticks

_R: Final = AfterSticks

_FS_OPTIONS_GO_ON: Final = {3: 1, 4: 4, 9: 8}
"""ArduCopter mode to the bit of FS_OPTIONS with which it goes on without a radio: AUTO, GUIDED, LAND."""

_FS_THR_ACTIONS: Final = {1: _R.RETURNS, 2: _R.RETURNS, 3: _R.LANDS, 4: _R.RETURNS, 5: _R.LANDS, 6: _R.RETURNS}
_AUTO: Final = 3
_CONTINUES_AUTO: Final = 2

_PX4_ACTIONS: Final = {1: _R.STAYS, 2: _R.RETURNS, 3: _R.LANDS}
_PX4_EXCEPTIONS: Final = {px4_custom_mode(4, 4): 1, px4_custom_mode(4, 3): 2, px4_custom_mode(6, 0): 4}
"""COM_RCL_EXCEPT: mission, hold, off-board."""

AfterSticksIn = Callable[[int], AfterSticks]
"""The answer for a custom_mode."""


def after_sticks(
    autopilot_kind: int, custom_mode: int, *, values: Mapping[str, float], has_radio: bool | None
) -> AfterSticks:
    """STAYS: the mode goes on. `values`: parameters by name, as far as they are known."""
    without = flies_without_sticks(autopilot_kind, custom_mode)
    if has_radio:
        return _R.STAYS if without else _R.SINKS
    if has_radio is None:
        return _R.UNKNOWN
    if autopilot_kind == mavlink.MAV_AUTOPILOT_PX4:
        return _px4(custom_mode, values)
    return _ardupilot(custom_mode, values, without=without)


def _ardupilot(custom_mode: int, values: Mapping[str, float], *, without: bool) -> AfterSticks:
    action = values.get("FS_THR_ENABLE")
    if action is None:
        return _R.UNKNOWN
    if action <= 0:
        return _R.STAYS if without else _R.UNKNOWN  # the last sticks stay in force
    if int(values.get("FS_OPTIONS", 0)) & _FS_OPTIONS_GO_ON.get(custom_mode, 0):
        return _R.STAYS
    if custom_mode == _AUTO and action == _CONTINUES_AUTO:
        return _R.STAYS
    return _FS_THR_ACTIONS.get(int(action), _R.UNKNOWN)


def _px4(custom_mode: int, values: Mapping[str, float]) -> AfterSticks:
    action = values.get("NAV_RCL_ACT")
    if action is None:
        return _R.UNKNOWN
    if int(values.get("COM_RCL_EXCEPT", 0)) & _PX4_EXCEPTIONS.get(custom_mode, 0):
        return _R.STAYS
    if action <= 0:
        return _R.STAYS if flies_without_sticks(mavlink.MAV_AUTOPILOT_PX4, custom_mode) else _R.UNKNOWN
    return _PX4_ACTIONS.get(int(action), _R.UNKNOWN)
