"""What ArduCopter does on a loss, from its parameters. Pure; facts from its documentation.

For a missing parameter it assumes ArduPilot's default only if that is the worse case.
"""

from collections.abc import Iterable, Mapping
from typing import Final

from wire.autopilots.loss_sentence import Sentence, danger, info, warning
from wire.autopilots.wanted_parameter import WantedParameter, with_bits
from wire.control_messages import LossParameters, SafetySettings

_ACTIONS: Final = {
    1: "returns to launch",
    2: "returns to launch, or goes on with a mission",
    3: "returns to launch the way it came",
    4: "returns the way it came, or lands",
    5: "lands where it is",
    6: "flies the landing of its mission, or returns to launch",
    7: "brakes, or lands",
}
_THROTTLE_ACTIONS: Final = {
    **_ACTIONS,
    3: "lands where it is",
    4: "returns to launch the way it came",
    5: "returns the way it came, or lands",
}

RADIO_IGNORED: Final = 1 << 0
OVERRIDES_IGNORED: Final = 1 << 1
RECEIVER_FAILSAFE_IGNORED: Final = 1 << 2
"""Bits of RC_OPTIONS."""

AUTO_GOES_ON_WITHOUT_RADIO: Final = 1 << 0
AUTO_GOES_ON_WITHOUT_GCS: Final = 1 << 1
GUIDED_GOES_ON_WITHOUT_RADIO: Final = 1 << 2
PILOTED_GOES_ON_WITHOUT_GCS: Final = 1 << 4
"""Bits of FS_OPTIONS."""

_DEFAULT_OVERRIDE_S: Final = 3.0
_DEFAULT_RADIO_FAILSAFE_S: Final = 1.0
_LONG_OVERRIDE_S: Final = 10.0
MAX_UNATTENDED_S: Final = 10.0
"""For so long a transmitter that nobody holds may fly the drone: it sinks by up to 15 m."""
_GOES_ON: Final = 1 | 4 | 8
"""FS_OPTIONS: missions, guided flight and landings go on without a radio."""


def _override_s(now: float) -> float:
    return now if 0 < now <= _LONG_OVERRIDE_S else _DEFAULT_OVERRIDE_S


WITHOUT_RECEIVER: Final = (
    WantedParameter(
        "FS_THR_ENABLE",
        lambda now: 1.0,
        "It returns to launch when sticks from the tower end in a mode that needs them.",
    ),
    WantedParameter("FS_OPTIONS", with_bits(_GOES_ON), "Missions, guided holds and landings go on without a radio."),
    WantedParameter(
        "RC_OVERRIDE_TIME", _override_s, "Sticks from the tower count, and expire if the computer on board fails."
    ),
)


WITH_RECEIVER: Final = (
    WantedParameter(
        "FS_GCS_ENABLE",
        lambda now: now if now > 0 else 1.0,
        "If the computer on board fails, it returns to launch instead of obeying a transmitter that nobody holds.",
    ),
    WantedParameter(
        "FS_OPTIONS",
        lambda now: float((int(now) | AUTO_GOES_ON_WITHOUT_GCS) & ~PILOTED_GOES_ON_WITHOUT_GCS),
        "It does so while it is flown by hand, too; a mission goes on.",
    ),
    WantedParameter(
        "FS_GCS_TIMEOUT", lambda now: now if 0 < now <= MAX_UNATTENDED_S else 5.0, "It does so within seconds."
    ),
    WantedParameter("RC_OVERRIDE_TIME", _override_s, "Sticks from the tower count, and expire if the computer fails."),
)


def is_simulated(values: Mapping[str, float]) -> bool:
    """Only a simulated autopilot has parameters whose name begins with SIM_."""
    return any(name.startswith("SIM_") for name in values)


def loss_sentences(parameters: LossParameters, safety: SafetySettings) -> Iterable[Sentence]:
    """In no particular order."""
    values = parameters.values
    yield from _overrides(values)
    yield from _ground_station(values, complete=parameters.complete)
    yield from _radio(values, parameters.has_radio)


def _overrides(values: dict[str, float]) -> Iterable[Sentence]:
    lasts_s = values.get("RC_OVERRIDE_TIME", _DEFAULT_OVERRIDE_S)
    if lasts_s == 0:
        yield danger(
            "operator",
            "RC_OVERRIDE_TIME is 0: the autopilot ignores sticks from the tower. Flying by hand through the tower, and "
            "the centred sticks with which a hold begins, are impossible.",
        )
    elif lasts_s < 0:
        yield danger(
            "operator",
            "RC_OVERRIDE_TIME is -1: sticks from the tower never expire. If the computer on board fails, the drone "
            "flies on with the last ones for ever.",
        )
    elif lasts_s > _LONG_OVERRIDE_S:
        yield warning(
            "operator",
            f"RC_OVERRIDE_TIME is {lasts_s:g} s: if the computer on board fails, the drone flies on with the last "
            "sticks for so long.",
        )
    if _bits(values, "RC_OPTIONS") & OVERRIDES_IGNORED:
        yield danger(
            "operator", "RC_OPTIONS makes the autopilot ignore sticks from the tower: a hold cannot centre them."
        )


def _ground_station(values: dict[str, float], *, complete: bool) -> Iterable[Sentence]:
    action = values.get("FS_GCS_ENABLE")
    after_s = values.get("FS_GCS_TIMEOUT", 5.0)
    if action is None:
        if complete:
            yield warning("tower", "The autopilot does not report what it does when the ground station is lost.")
    elif action <= 0:
        words = "FS_GCS_ENABLE is 0: if the computer on board fails, the autopilot does not react to the loss"
        if values.get("FS_THR_ENABLE", 1.0) <= 0:
            yield danger("tower", f"{words}, and nothing else is set to bring the drone down or back.")
        else:
            yield warning("tower", f"{words}.")
    else:
        does = _ACTIONS.get(int(action), "acts as configured")
        yield info(
            "tower",
            f"Without the computer on board the autopilot {does} after {after_s:g} s (FS_GCS_ENABLE {action:g}).",
        )
        options = _bits(values, "FS_OPTIONS")
        if options & PILOTED_GOES_ON_WITHOUT_GCS:
            yield warning("tower", "FS_OPTIONS: not while it is flown by hand, where it flies on.")
        if options & AUTO_GOES_ON_WITHOUT_GCS:
            yield info("tower", "FS_OPTIONS: not during a mission, which goes on.")
    sender = values.get("SYSID_MYGCS", values.get("MAV_GCS_SYSID"))
    if sender is None:
        yield warning(
            "operator", "Neither SYSID_MYGCS nor MAV_GCS_SYSID is known: 255 is assumed, and sticks may be ignored."
        )
    elif sender != 255:
        yield info(
            "operator",
            f"The autopilot listens to ground station {sender:g} only. The agent speaks as {sender:g}; another ground "
            "station on a radio link that speaks as 255 is ignored.",
        )


def _radio(values: dict[str, float], has_radio: bool | None) -> Iterable[Sentence]:
    failsafe = values.get("FS_THR_ENABLE")
    if has_radio is None:
        yield danger(
            "radio",
            "It is not known whether a radio receiver is on board, and so not how a hold ends if the computer on board "
            "fails.",
        )
    elif has_radio:
        yield from _with_receiver(values)
    else:
        yield from _without_receiver(values, failsafe)
    if failsafe is not None and failsafe <= 0 and has_radio is not False:
        yield warning("radio", "FS_THR_ENABLE is 0: the autopilot does nothing when the transmitter is lost.")
    if _bits(values, "RC_OPTIONS") & RECEIVER_FAILSAFE_IGNORED:
        yield warning("radio", "RC_OPTIONS makes the autopilot ignore the receiver's own failsafe signal.")
    if failsafe is not None and failsafe > 0 and _bits(values, "FS_OPTIONS") & AUTO_GOES_ON_WITHOUT_RADIO:
        yield info("radio", "FS_OPTIONS: a mission goes on without the radio.")


def _with_receiver(values: dict[str, float]) -> Iterable[Sentence]:
    lasts_s = values.get("RC_OVERRIDE_TIME", _DEFAULT_OVERRIDE_S)
    if values.get("FS_THR_ENABLE", 1.0) <= 0 or _bits(values, "FS_OPTIONS") & GUIDED_GOES_ON_WITHOUT_RADIO:
        yield info("radio", "There is a receiver: a hold stays in BRAKE or GUIDED without anybody's sticks.")
    else:
        yield info(
            "radio",
            "There is a receiver: a hold stays in BRAKE or GUIDED. After a flight by hand the agent keeps centred "
            "sticks coming, because FS_OPTIONS lacks 4 and they hide whether the transmitter is lost.",
        )
    yield _falls_back_to_transmitter(values, max(lasts_s, 0.0))
    if _bits(values, "RC_OPTIONS") & RADIO_IGNORED:
        yield warning("radio", "RC_OPTIONS makes the autopilot ignore the radio receiver: it cannot help.")


def _falls_back_to_transmitter(values: dict[str, float], lasts_s: float) -> Sentence:
    """Measured: with a transmitter at rest the drone is on the ground 18 s after the computer failed at 34 m."""
    action, after_s = values.get("FS_GCS_ENABLE", 0.0), values.get("FS_GCS_TIMEOUT", 5.0)
    flies_on = _bits(values, "FS_OPTIONS") & PILOTED_GOES_ON_WITHOUT_GCS
    if action <= 0 or flies_on or after_s > MAX_UNATTENDED_S:
        return danger(
            "radio",
            "If the computer on board fails while the drone is flown by hand, or in the first seconds of a hold, the "
            f"transmitter's own sticks come back after {lasts_s:g} s: one that lies on the bench with its throttle low "
            "lands the drone on the spot.",
        )
    does = _ACTIONS.get(int(action), "acts as configured")
    return info(
        "radio",
        "If the computer on board fails while the drone is flown by hand, or in the first seconds of a hold, the "
        f"transmitter's own sticks come back after {lasts_s:g} s, and after {after_s:g} s the autopilot {does} "
        f"(FS_GCS_ENABLE {action:g}).",
    )


def _without_receiver(values: dict[str, float], failsafe: float | None) -> Iterable[Sentence]:
    # It counts from the last message that brought sticks, though these themselves are in force for longer.
    wait_s = values.get("RC_FS_TIMEOUT", _DEFAULT_RADIO_FAILSAFE_S)
    if failsafe is None:
        yield warning(
            "radio",
            "The autopilot does not report FS_THR_ENABLE. It is not known what it does when sticks from the tower end.",
        )
        return
    if failsafe <= 0:
        yield danger(
            "radio",
            "FS_THR_ENABLE is 0 and there is no radio: if the computer on board fails while the drone is flown by "
            "hand, the last sticks stay, and nothing brings it down or back.",
        )
        return
    does = f"the autopilot {_THROTTLE_ACTIONS.get(int(failsafe), 'acts as configured')} (FS_THR_ENABLE {failsafe:g})"
    if _bits(values, "FS_OPTIONS") & GUIDED_GOES_ON_WITHOUT_RADIO:
        yield info(
            "radio",
            f"There is no radio. {wait_s:g} s after the last sticks from the tower {does}, but not in GUIDED, in which "
            "a hold stays without sticks (FS_OPTIONS).",
        )
        return
    yield danger(
        "radio",
        f"There is no radio and FS_OPTIONS lacks 4: in GUIDED or BRAKE without sticks {does} after {wait_s:g} s. "
        "The agent keeps centred sticks coming in a hold to prevent that; if it fails, a hold ends that way without a "
        "warning.",
    )


def _bits(values: dict[str, float], name: str) -> int:
    return int(values.get(name, 0))
