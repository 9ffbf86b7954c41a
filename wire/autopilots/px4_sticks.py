"""Whose sticks PX4 obeys, and what it makes of their motion. Pure; read in its sources and measured on 1.16.

Each axis passes a derivative filter of 0.1 s. While its output is above COM_RC_STICK_OV, PX4 leaves a mode that flies
without sticks for POSCTL ("Pilot took over using sticks"), if COM_RC_OVERRIDE tells it so. It does not know whose
sticks they are: the jump of an agent's sticks from deflected to centred is such a motion.
"""

from collections.abc import Mapping
from math import log
from typing import Final

RADIO_BEFORE_STICKS: Final = (2, 3, 5, 7)
"""Values of COM_RC_IN_MODE with which a radio that is on keeps the sticks: the source in use until it falls silent, or
for good (a radio nearly always comes first); since 1.17 a radio's priority (5, 7). With 6 and 8 the tower's sticks come
first."""
NOBODYS: Final = 4
"""The value with which it takes no sticks at all, and misses none."""
STICKS_IGNORED: Final = (0, NOBODYS)
"""Values that leave no room for sticks from the tower: radio only, nobody."""
_NO_RADIO: Final = (1, NOBODYS)
"""Values with which a receiver on board moves nothing."""

_OVERRIDES_AUTO: Final = 1
"""Bit of COM_RC_OVERRIDE; the default has it."""
_STICK_CHANGE_PERCENT: Final = 30.0
"""COM_RC_STICK_OV by default."""
_PEAK: Final = 20.0
"""Output of the filter after the largest jump, from one end of an axis to the other: 2 within its 0.1 s."""
_DECAY_S: Final = 0.125
"""The filter's time, as it works on sticks that come every 50 ms."""
_MARGIN_S: Final = 0.1
"""For the way to the autopilot, and the commander's interval."""


def ignores_tower(values: Mapping[str, float], has_radio: bool | None) -> bool:
    """Whether it moves nothing by sticks from the tower. `values`: parameters by name."""
    source = values.get("COM_RC_IN_MODE")
    return source in STICKS_IGNORED or (source in RADIO_BEFORE_STICKS and bool(has_radio))


def uses_receiver(values: Mapping[str, float]) -> bool:
    """Whether a receiver on board replaces sticks from the tower that end."""
    return values.get("COM_RC_IN_MODE") not in _NO_RADIO


def settles_after_s(values: Mapping[str, float]) -> float:
    """Seconds for which sticks must not move before a mode without sticks is requested; 0 if motion changes no mode."""
    if not int(values.get("COM_RC_OVERRIDE", _OVERRIDES_AUTO)) & _OVERRIDES_AUTO:
        return 0.0
    threshold = max(values.get("COM_RC_STICK_OV", _STICK_CHANGE_PERCENT), 1.0) / 100.0
    return _DECAY_S * log(_PEAK / threshold) + _MARGIN_S
