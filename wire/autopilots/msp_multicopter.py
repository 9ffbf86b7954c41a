"""Betaflight, INAV and other flight controllers that speak MSP, as the agent's MSP port shows them (docs/agent.md).

They have switches ("boxes") in place of modes: the port enters a mode by moving the switch that the controller's owner
set up for it, and has no other way. It takes sticks and switches only as a stream; when the stream ends, the
controller's own failsafe acts, and MSP does not tell which. Nothing is measured on them, so the agent changes none of
their modes by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Final

from wire.autopilots import payload_steps
from wire.autopilots.commands import Arm, CommandStep, Disarm, Steps, Unable, VehicleState
from wire.autopilots.loss_sentence import Sentence, danger
from wire.autopilots.profile import (
    AutopilotFamily,
    AutopilotProfile,
    FlightMode,
    FlightTask,
    ModeRoles,
    Sticks,
    change_mode,
)
from wire.autopilots.vehicle_types import MULTICOPTERS
from wire.autopilots.watched import watched_only
from wire.control_messages import LossParameters, SafetySettings
from wire.dialect import mavlink
from wire.firmware import Release
from wire.open_holds import AfterSticks
from wire.plan_fields import KeptFields
from wire.plan_verbatim import Verbatim
from wire.transactions import CommandWork

BOXES: Final[Mapping[str, frozenset[str]]] = {
    "FAILSAFE": frozenset({"FAILSAFE"}),
    "RETURN": frozenset({"RTH", "GPSRESCUE"}),
    "MISSION": frozenset({"WP"}),
    "POSHOLD": frozenset({"POSHOLD"}),
    "ALTHOLD": frozenset({"ALTHOLD"}),
    "ANGLE": frozenset({"ANGLE"}),
    "HORIZON": frozenset({"HORIZON"}),
    "MANUAL": frozenset({"MANUAL", "PASSTHRU"}),
}
"""The boxes of each mode without spaces and `NAV`, the one that says most about who flies first."""
NUMBERS: Final = {name: number for number, name in enumerate(("UNKNOWN", "ACRO", *BOXES))}
"""custom_mode, as the port's heartbeats have it."""


def _mode(name: str, label: str, **more: Any) -> FlightMode:
    return FlightMode(name, NUMBERS[name], (NUMBERS[name], 0), label, **more)


def _by_hand(name: str, label: str, **more: Any) -> FlightMode:
    return _mode(name, label, task=FlightTask.BY_HAND, needs_position=False, **more)


_RETURN: Final = _mode(
    "RETURN", "Return", aliases=("RTL",), sticks=Sticks.IGNORED, task=FlightTask.RETURN, offered=True
)
_POSHOLD: Final = _mode("POSHOLD", "Position hold", task=FlightTask.BY_HAND, holds_when_centred=True, offered=True)
_MISSION: Final = _mode("MISSION", "Mission", sticks=Sticks.IGNORED, task=FlightTask.MISSION, flies_mission=True)
_MODES: Final = (
    _by_hand("UNKNOWN", "Unknown", settable=False),
    _by_hand("ACRO", "Acro"),
    _mode("FAILSAFE", "Failsafe", sticks=Sticks.IGNORED, settable=False),
    _RETURN,
    _MISSION,
    _POSHOLD,
    _by_hand("ALTHOLD", "Altitude hold", holds_when_centred=True, drifts=True, offered=True),
    _by_hand("ANGLE", "Angle", offered=True),
    _by_hand("HORIZON", "Horizon"),
    _by_hand("MANUAL", "Manual", settable=False),
)
_UNABLE: Final[Unable[Any]] = Unable("is flown by sticks and switches only: MSP has no such command")


def _main_of(custom_mode: int) -> int:
    return custom_mode


def _custom_mode(main: float, sub: float) -> int:
    return int(main)


def _after_sticks(custom_mode: int, values: Mapping[str, float], without: bool) -> AfterSticks:
    """Its failsafe acts: drop, land, rescue or return, as its configurator says."""
    return AfterSticks.UNKNOWN


def _keeping(vehicle_type: int, release: Release | None) -> KeptFields:
    return Verbatim()


def _loss_sentences(parameters: LossParameters, safety: SafetySettings) -> Iterable[Sentence]:
    """The same for each of them: MSP tells neither its failsafe nor a receiver."""
    yield danger(
        "operator",
        "This controller has no hold that can be ordered and seen. A hold sends centred sticks: in POSHOLD it stays, "
        "in ALTHOLD it keeps its height, and in any other mode it sinks, climbs or flies on.",
    )
    yield danger(
        "tower",
        "When sticks end, its own failsafe acts: drop, land, rescue or return. MSP does not tell which is set up.",
    )


def _arm(state: VehicleState, command: Arm | Disarm) -> Steps:
    arms = isinstance(command, Arm)
    work = CommandWork(int(mavlink.MAV_CMD_COMPONENT_ARM_DISARM), (float(arms), *(0.0,) * 6))
    return (CommandStep("arming" if arms else "disarming", work),)


MSP: Final = AutopilotFamily(
    # MAVLink has no number for them. GENERIC, 0, is taken: it stands for an autopilot that was not heard yet.
    autopilot=int(mavlink.MAV_AUTOPILOT_RESERVED),
    name="msp",
    label="MSP",
    main_of=_main_of,
    custom_mode=_custom_mode,
    reads_frames=True,
    zero_is_here=False,
    has_home_slot=False,
    targets_by_command=False,
    bytes_in_parameters=False,
    packs_parameters=False,
    arms_with_throttle_down=True,
    silent_without_receiver=False,
    loss_parameters=(),
    deciding_parameters=(),
    after_sticks=_after_sticks,
    keeping=_keeping,
    loss_sentences=_loss_sentences,
)

PROFILE: Final = AutopilotProfile(
    key="msp_multicopter",
    label="Betaflight or INAV",
    family=MSP,
    vehicle_types=MULTICOPTERS,
    modes=_MODES,
    roles=ModeRoles(returns=_RETURN, mission=_MISSION, by_hand=_POSHOLD),
    commands=replace(
        watched_only(returns=_RETURN),
        arm=_arm,
        disarm=_arm,
        mode=change_mode(_MODES),
        servo=payload_steps.set_servo,  # of the companion computer: the controller itself refuses it
        **dict.fromkeys(
            (
                *("takeoff", "goto", "hold", "pause", "resume", "land", "speed", "turn", "set_home", "start", "jump"),
                *("orbit", "roi", "gripper", "gimbal", "zoom", "photo", "record", "motor_test", "reboot"),
                *("calibrate", "calibration_pose", "calibration_end"),
            ),
            _UNABLE,
        ),
    ),
    takes_centred_sticks=True,
    stands_in=True,
)
