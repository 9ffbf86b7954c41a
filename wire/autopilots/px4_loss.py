"""What PX4 does on a loss, from its parameters. Pure; facts from its documentation."""

from collections.abc import Iterable, Mapping
from typing import Final

from wire.autopilots import px4_sticks
from wire.autopilots.loss_sentence import About, Sentence, danger, info, warning
from wire.autopilots.wanted_parameter import WantedParameter, with_bits
from wire.control_messages import LossParameters, SafetySettings
from wire.open_holds import LostAction

_ACTIONS: Final = {
    1: "holds its place",
    2: "returns to launch",
    3: "lands where it is",
}
_DELAYED: Final = (2, 3)
"""It holds for COM_FAIL_ACT_T first."""
_BY_STICKS: Final = (0, 1, 2)
"""COM_OBL_RC_ACT: position, altitude, by hand."""
TERMINATE: Final = 5
DISARM: Final = 6

HOLDS_WITHOUT_STICKS: Final = "AUTO.LOITER"

STAYS: Final = 1
"""NAV_RCL_ACT: holds its place. Above it, the autopilot leaves a hold."""
HOLD_EXCEPTED: Final = 2

_EXCEPT: Final = {1: "a mission", 2: "a hold", 4: "offboard flight"}
"""Bits of COM_RCL_EXCEPT."""


_HOLDS: Final = 5.0
_RETURN: Final = 2.0
_JOYSTICK: Final = 1.0
_ALL_EXCEPTED: Final = 1 | 2 | 4

WITHOUT_RECEIVER: Final = (
    WantedParameter("COM_RC_IN_MODE", lambda now: _JOYSTICK, "Sticks come from the tower, and no radio is asked for."),
    WantedParameter(
        "NAV_RCL_ACT",
        lambda now: now if now > 0 else _RETURN,
        "It does something when sticks from the tower end in a mode that needs them: it returns.",
    ),
    WantedParameter(
        "COM_RCL_EXCEPT", with_bits(_ALL_EXCEPTED), "Missions, holds and offboard flight go on without sticks."
    ),
    WantedParameter(
        "COM_OBL_RC_ACT",
        lambda now: _HOLDS if now in _BY_STICKS else now,
        "It holds when a controller on board ends, and does not sink by sticks that nobody sends.",
    ),
)


def is_simulated(values: Mapping[str, float]) -> bool:
    """A real board may have parameters whose name begins with SIM_. Only those count that switch a simulation on: in
    the loop, on the board itself, in Gazebo, or in its own simulation (SIH) in SITL, by its GPS."""
    return any(values.get(name, 0) > 0 for name in ("SYS_HITL", "SIM_GZ_EN", "SENS_EN_GPSSIM"))


def loss_sentences(parameters: LossParameters, safety: SafetySettings) -> Iterable[Sentence]:
    """In no particular order."""
    values = parameters.values
    source = values.get("COM_RC_IN_MODE")
    if px4_sticks.ignores_tower(values, parameters.has_radio):
        ignored = f"COM_RC_IN_MODE is {source:g}: the autopilot ignores sticks from the tower"
        if source in px4_sticks.RADIO_BEFORE_STICKS:
            ignored += " while the radio is on"
        yield warning(
            "operator",
            f"{ignored}. Flying by hand through the tower is impossible; a hold needs no sticks, but a position.",
        )
    yield from _action(values.get("NAV_RCL_ACT"), about="radio", name="NAV_RCL_ACT", what=_sticks_lost(parameters))
    excepted = [words for bit, words in _EXCEPT.items() if int(values.get("COM_RCL_EXCEPT", 0)) & bit]
    if excepted:
        yield info("radio", f"COM_RCL_EXCEPT: not during {', '.join(excepted)}, which goes on.")
    link_action = values.get("NAV_DLL_ACT")
    after_s = values.get("COM_DL_LOSS_T", 10.0) + _holds_before_s(values, link_action)
    lost = f"Without the computer on board, after {after_s:g} s,"
    if link_action in _ACTIONS:
        yield warning(
            "tower",
            f"The autopilot does the same {after_s:g} s after the tower, or the person at the controls, is gone in a "
            "mission or another flight by itself, whatever is set here.",
        )
    silence_s = values.get("COM_DL_LOSS_T", 10.0)
    if link_action == 0 and station_lost(values, 0, mission_is_over=True) is not None:
        yield info(
            "tower",
            f"Where a mission ends in the air with nobody at the controls for {silence_s:g} s, the autopilot returns "
            "to launch.",
        )
    if link_action == 0:
        words = "NAV_DLL_ACT is 0: if the computer on board fails, the autopilot does not react to the loss"
        if values.get("NAV_RCL_ACT") == 0:
            yield danger("tower", f"{words}, and nothing else is set to bring the drone down or back.")
        else:
            yield warning("tower", f"{words}.")
    else:
        yield from _action(link_action, about="tower", name="NAV_DLL_ACT", what=lost)
    yield from _hold_without_sticks(parameters)
    yield from _set_points_lost(values)


def station_lost(
    values: Mapping[str, float], exceptions: int, *, mission_is_over: bool
) -> tuple[LostAction, float] | None:
    """What it does by itself without a ground station's heartbeats, and how many seconds after the last one.

    `exceptions`: the bit of COM_DLL_EXCEPT and COM_RCL_EXCEPT for its flight mode; 0: there is none.
    """
    silence_s, link_action = values.get("COM_DL_LOSS_T", 10.0), values.get("NAV_DLL_ACT")
    action = {2: LostAction.RETURN, 3: LostAction.LAND}.get(int(link_action or 0))
    if action is not None:
        is_excepted = int(values.get("COM_DLL_EXCEPT", 0)) & exceptions
        return None if is_excepted else (action, silence_s + _holds_before_s(values, link_action))
    misses_no_sticks = values.get("COM_RC_IN_MODE") == px4_sticks.NOBODYS or int(values.get("COM_RCL_EXCEPT", 0)) & 1
    if link_action == 0 and mission_is_over and misses_no_sticks:
        return LostAction.RETURN, silence_s
    return None


def _set_points_lost(values: Mapping[str, float]) -> Iterable[Sentence]:
    action = values.get("COM_OBL_RC_ACT")
    if action in _BY_STICKS:
        yield warning(
            "tower",
            f"If a controller on board ends in the middle of its flight, the autopilot flies by sticks "
            f"(COM_OBL_RC_ACT {action:g}). If the computer on board fails with it, and there are none, the drone may "
            f"sink to the ground: 5 makes it hold.",
        )


def _holds_before_s(values: Mapping[str, float], action: float | None) -> float:
    """How long it holds before it acts."""
    return values.get("COM_FAIL_ACT_T", 5.0) if action in _DELAYED else 0.0


def _hold_without_sticks(parameters: LossParameters) -> Iterable[Sentence]:
    """How the second stage of a hold ends, in which the agent's sticks stop."""
    values, has_radio = parameters.values, _effective_radio(parameters)
    if has_radio is None:
        yield danger(
            "radio",
            "It is not known whether a radio receiver is on board, and so not how a hold ends if the computer on board "
            "fails.",
        )
    elif has_radio:
        yield info("radio", f"There is a receiver: a hold stays in {HOLDS_WITHOUT_STICKS} without anybody's sticks.")
        yield warning(
            "radio",
            "If the computer on board fails while the drone is flown by hand, or in the first seconds of a hold, the "
            "transmitter's own sticks come back: one that lies on the bench with its throttle low makes the drone "
            "descend.",
        )
    elif values.get("NAV_RCL_ACT", 0.0) > STAYS and not int(values.get("COM_RCL_EXCEPT", 0)) & HOLD_EXCEPTED:
        does = _ACTIONS.get(int(values["NAV_RCL_ACT"]), "acts as configured")
        yield danger(
            "radio",
            f"There is no radio and COM_RCL_EXCEPT lacks 2: in {HOLDS_WITHOUT_STICKS} without sticks the autopilot "
            f"{does} after {_sticks_lost_s(values):g} s. The agent keeps centred sticks coming in a hold to "
            "prevent that; if it fails, a hold ends that way without a warning.",
        )


def _sticks_lost(parameters: LossParameters) -> str:
    after_s = _sticks_lost_s(parameters.values)
    if _effective_radio(parameters) is False:
        return f"There is no radio. {after_s:g} s after the last sticks from the tower"
    return f"{after_s:g} s after the last sticks, from the radio or from the tower,"


def _effective_radio(parameters: LossParameters) -> bool | None:
    """A receiver that moves nothing counts as none."""
    return False if not px4_sticks.uses_receiver(parameters.values) else parameters.has_radio


def _sticks_lost_s(values: Mapping[str, float]) -> float:
    return values.get("COM_RC_LOSS_T", 0.5) + _holds_before_s(values, values.get("NAV_RCL_ACT"))


def _action(value: float | None, *, about: About, name: str, what: str) -> Iterable[Sentence]:
    if value is None:
        yield warning(about, f"The autopilot does not tell {name}: it is not known what it does then.")
    elif value == 0:
        yield danger(about, f"{name} is 0: when sticks end, nothing brings the drone down or back.")
    elif value in (TERMINATE, DISARM):
        yield danger(about, f"{what} the autopilot stops the motors, and the drone falls ({name} {value:g}).")
    else:
        yield info(about, f"{what} the autopilot {_ACTIONS.get(int(value), 'acts as configured')} ({name} {value:g}).")
