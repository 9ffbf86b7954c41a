"""What happens if operator, tower or radio are lost, in plain words. Pure.

The profiles have the facts about the autopilots (`wire/autopilots/*_loss.py`). This file has what the agent does, and
what is the same for all autopilots.
"""

import hashlib
from collections.abc import Iterable
from math import isfinite

import msgspec

from server.kernel.drone_settings import ALTITUDE_HOLDS, DroneSettings
from wire.autopilots import registry
from wire.autopilots.loss_sentence import Sentence, danger, info, warning
from wire.control_messages import LossParameters
from wire.open_holds import LostAction

_THEN = {
    LostAction.RETURN: "it is told to return to launch, and without a position to land",
    LostAction.LAND: "it is told to land where it is",
    LostAction.CONTINUE: "a mission goes on, and anything else stays",
    LostAction.STAY: "it stays, until the battery is needed for the way home: then it returns",
}


WATCHED_ONLY = (
    "This vehicle is watched only: nobody has measured how it holds. Whoever is lost, the agent sends it neither "
    "sticks nor a mode, and a hold is not carried out. What it does then is up to its autopilot's own failsafes."
)


def loss_sentences(
    parameters: LossParameters | None, settings: DroneSettings, *, watched_only: bool = False
) -> list[Sentence]:
    """In the order operator, tower, radio. `parameters`: None until the agent has reported them. `watched_only`: the
    agent does nothing by itself."""
    if watched_only:
        return [warning("operator", WATCHED_ONLY)]
    found = [*_of_ours(settings)]
    if parameters is None:
        found.append(
            warning("operator", "The autopilot's own failsafes are unknown: its parameters have not been read.")
        )
        return found
    sane = {name: value for name, value in parameters.values.items() if isfinite(value)}
    parameters = msgspec.structs.replace(parameters, values=sane)
    if not parameters.complete:
        found.append(warning("operator", "Not all parameters that matter for a loss are known."))
    family = registry.family_named(parameters.autopilot)
    if family is not None and family.loss_sentences is not None:
        found += family.loss_sentences(parameters, settings.safety)
    else:
        known = " nor ".join(one.label for one in registry.FAMILIES.values() if one.loss_sentences is not None)
        found.append(warning("operator", f"This autopilot is neither {known}: what it does on a loss is unknown."))
    order = ("operator", "tower", "radio")
    return sorted(found, key=lambda sentence: order.index(sentence.about))


def _of_ours(settings: DroneSettings) -> Iterable[Sentence]:
    safety = settings.safety
    ladder = [mode for mode in safety.hold_ladder if mode not in ALTITUDE_HOLDS]
    modes = f"{', '.join(ladder)}, then altitude hold" if ladder else "altitude hold"
    then = _THEN[safety.lost_action]
    yield info(
        "operator",
        f"Flown by hand, the drone holds when no fresh sticks come for {safety.sticks_stale_s:g} s, when the "
        f"pilot's browser is gone for 2 s, or when the round trip is above {safety.rtt_limit_ms:g} ms for "
        f"{safety.rtt_limit_s:g} s: at once in {modes} with centred sticks, and as soon as it is level and has a "
        "position in a mode that stays and uses nobody's sticks.",
    )
    stays_away = f"When the pilot is lost for {safety.lost_action_s:g} s, {then}."
    yield info("operator", f"A hold does not end by itself. {stays_away}")
    yield info(
        "operator", "Without a position it stays in altitude hold, which keeps the height and drifts with the wind."
    )
    yield info(
        "tower",
        f"Flown by hand, the drone holds by itself when the tower is silent for {safety.lost_hold_s:g} s. After "
        f"{safety.lost_action_s:g} s {then}.",
    )


def is_dangerous(sentences: Iterable[Sentence]) -> bool:
    """Whether a loss would drop or lose the drone: the holder must then acknowledge it before arming."""
    return any(sentence.severity == "danger" for sentence in sentences)


def findings_hash(sentences: Iterable[Sentence]) -> str:
    """Identifies the dangers. An acknowledgement is valid for exactly these sentences; a new danger needs a new one."""
    dangers = sorted(f"{one.about}: {one.text}" for one in sentences if one.severity == "danger")
    return hashlib.sha256("\n".join(dangers).encode()).hexdigest()


__all__ = ["Sentence", "danger", "findings_hash", "is_dangerous", "loss_sentences"]
