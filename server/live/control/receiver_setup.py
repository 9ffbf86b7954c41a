"""Which parameters an autopilot needs to fly without a radio receiver, and why. Pure.

Without a receiver the end of the agent's sticks is a radio failsafe: these make it come home out of a mode that needs
sticks, and go on in one that needs none.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Final

from wire.control_messages import LossParameters

MAX_OVERRIDE_S: Final = 10.0
USUAL_OVERRIDE_S: Final = 3.0
GOES_ON: Final = 1 | 4 | 8
"""FS_OPTIONS: missions, guided flight and landings go on without a radio."""
EXCEPTED: Final = 1 | 2 | 4
"""COM_RCL_EXCEPT: mission, hold, offboard."""
RETURN: Final = 2.0
JOYSTICK: Final = 1.0


@dataclass(frozen=True)
class SetupRow:
    """One parameter. `now` None: not read; `wanted` is then the minimum."""

    name: str
    now: float | None
    wanted: float
    why: str

    @property
    def ok(self) -> bool:
        return self.now == self.wanted


@dataclass(frozen=True)
class ReceiverSetup:
    """The setup of one drone. `autopilot`: `ardupilot`, `px4`, or empty for another."""

    autopilot: str
    has_radio: bool | None
    rows: tuple[SetupRow, ...]

    @property
    def known(self) -> bool:
        """Whether each of them was read."""
        return bool(self.rows) and all(row.now is not None for row in self.rows)

    @property
    def needed(self) -> bool:
        """Whether it flies without a receiver and is not set up for it."""
        return self.has_radio is False and any(not row.ok for row in self.rows)

    @property
    def to_write(self) -> dict[str, float]:
        """By name, what is not as it should be."""
        return {row.name: row.wanted for row in self.rows if not row.ok}

    @property
    def text(self) -> str:
        """For people, in a sentence or two."""
        if not self.rows:
            return "This set-up exists for ArduPilot and PX4 only. The autopilot is not known to be one of them."
        if self.has_radio is None:
            return "It is not known whether a radio receiver is on board."
        if self.has_radio:
            return "A radio receiver is on board: none of this is needed."
        if not self.known:
            return "There is no radio receiver, and not all relevant parameters are known yet."
        if self.needed:
            return "There is no radio receiver, and the autopilot is not set up to fly without one."
        return "There is no radio receiver, and the autopilot is set up to fly without one."


@dataclass(frozen=True)
class _Wanted:
    name: str
    value: Callable[[float], float]
    """For the present value."""
    why: str


def _with_bits(bits: int) -> Callable[[float], float]:
    return lambda now: float(int(now) | bits)


def _override_s(now: float) -> float:
    return now if 0 < now <= MAX_OVERRIDE_S else USUAL_OVERRIDE_S


_ARDUPILOT: Final = (
    _Wanted(
        "FS_THR_ENABLE",
        lambda now: 1.0,
        "It returns to launch when sticks from the tower end in a mode that needs them.",
    ),
    _Wanted("FS_OPTIONS", _with_bits(GOES_ON), "Missions, guided holds and landings go on without a radio."),
    _Wanted("RC_OVERRIDE_TIME", _override_s, "Sticks from the tower count, and expire if the computer on board fails."),
)
_PX4: Final = (
    _Wanted("COM_RC_IN_MODE", lambda now: JOYSTICK, "Sticks come from the tower, and no radio is asked for."),
    _Wanted(
        "NAV_RCL_ACT",
        lambda now: now if now > 0 else RETURN,
        "It does something when sticks from the tower end in a mode that needs them: it returns.",
    ),
    _Wanted("COM_RCL_EXCEPT", _with_bits(EXCEPTED), "Missions, holds and offboard flight go on without sticks."),
)
_BY_AUTOPILOT: Final = {"ardupilot": _ARDUPILOT, "px4": _PX4}


def receiver_setup(parameters: LossParameters | None) -> ReceiverSetup:
    """`parameters`: None until the agent has reported them."""
    if parameters is None:
        return ReceiverSetup("", None, ())
    rows = tuple(_row(one, parameters.values.get(one.name)) for one in _BY_AUTOPILOT.get(parameters.autopilot, ()))
    return ReceiverSetup(parameters.autopilot, parameters.has_radio, rows)


def _row(one: _Wanted, now: float | None) -> SetupRow:
    known = now if now is not None and isfinite(now) else None
    return SetupRow(one.name, known, one.value(known if known is not None else 0.0), one.why)
