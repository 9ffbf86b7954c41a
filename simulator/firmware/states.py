"""The states of the flight controller and what every event does in each of them: one table, without a gap.

A pair that must not happen is in the table too, as a Refusal with its reason.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum


class SystemState(StrEnum):
    INIT = "SYS_INIT"
    STARTUP = "SYS_STARTUP"
    SAFE = "SYS_SAFE"
    RUN_AUTO = "SYS_RUN_AUTO"
    RUN_MANUAL = "SYS_RUN_MANUAL"
    FAIL_MINOR = "SYS_FAIL_MINOR"
    """Still flying, with something wrong from which it recovers."""
    FAIL_MAJOR = "SYS_FAIL_MAJOR"
    """On the way to SYS_SAFE: it lands, or falls, and stops its motors."""


class Event(StrEnum):
    INIT_PASSED = "init passed"
    STARTUP_PASSED = "startup passed"
    AUTO_REQUESTED = "auto requested"
    MANUAL_REQUESTED = "manual requested"
    STOP_REQUESTED = "stop requested"
    """Disarm."""
    MINOR_FAULT = "minor fault"
    MAJOR_FAULT = "major fault"
    RECOVERED_TO_AUTO = "recovered to auto"
    RECOVERED_TO_MANUAL = "recovered to manual"
    MOTORS_STOPPED = "motors stopped"
    RESET = "reset"


@dataclass(frozen=True, slots=True)
class Refusal:
    """The event is not allowed in this state, which stays as it is."""

    reason: str


Outcome = SystemState | Refusal

FLYING = frozenset({SystemState.RUN_AUTO, SystemState.RUN_MANUAL, SystemState.FAIL_MINOR, SystemState.FAIL_MAJOR})
"""States with motors armed."""

_NOT_READY = Refusal("not ready: the start is not finished")
_FLYING = Refusal("armed: stop first")
_FAILED = Refusal("a major fault: it stops")
_PASSED = Refusal("already passed")


def _row(
    state: SystemState,
    *,
    auto: Outcome,
    manual: Outcome,
    minor: Outcome,
    reset: Outcome,
    stop: Outcome | None = None,
    init: Outcome = _PASSED,
    startup: Outcome = _PASSED,
    to_auto: Outcome | None = None,
    to_manual: Outcome | None = None,
    stopped: Outcome | None = None,
) -> dict[tuple[SystemState, Event], Outcome]:
    """What is None changes nothing. A major fault ends every state."""
    return {
        (state, Event.INIT_PASSED): init,
        (state, Event.STARTUP_PASSED): startup,
        (state, Event.AUTO_REQUESTED): auto,
        (state, Event.MANUAL_REQUESTED): manual,
        (state, Event.STOP_REQUESTED): stop or state,
        (state, Event.MINOR_FAULT): minor,
        (state, Event.MAJOR_FAULT): SystemState.FAIL_MAJOR,
        (state, Event.RECOVERED_TO_AUTO): to_auto or state,
        (state, Event.RECOVERED_TO_MANUAL): to_manual or state,
        (state, Event.MOTORS_STOPPED): stopped or state,
        (state, Event.RESET): reset,
    }


S = SystemState
TABLE: Mapping[tuple[SystemState, Event], Outcome] = {
    **_row(
        S.INIT,
        init=S.STARTUP,
        startup=Refusal("the initialisation has not passed"),
        auto=_NOT_READY,
        manual=_NOT_READY,
        minor=S.INIT,
        reset=S.INIT,
    ),
    **_row(S.STARTUP, startup=S.SAFE, auto=_NOT_READY, manual=_NOT_READY, minor=S.STARTUP, reset=S.INIT),
    **_row(S.SAFE, auto=S.RUN_AUTO, manual=S.RUN_MANUAL, minor=S.SAFE, reset=S.INIT),
    **_row(
        S.RUN_AUTO,
        auto=S.RUN_AUTO,
        manual=S.RUN_MANUAL,
        minor=S.FAIL_MINOR,
        stop=S.SAFE,
        stopped=S.SAFE,
        reset=_FLYING,
    ),
    **_row(
        S.RUN_MANUAL,
        auto=S.RUN_AUTO,
        manual=S.RUN_MANUAL,
        minor=S.FAIL_MINOR,
        stop=S.SAFE,
        stopped=S.SAFE,
        reset=_FLYING,
    ),
    **_row(
        S.FAIL_MINOR,
        auto=S.FAIL_MINOR,
        manual=S.FAIL_MINOR,
        minor=S.FAIL_MINOR,
        to_auto=S.RUN_AUTO,
        to_manual=S.RUN_MANUAL,
        stop=S.SAFE,
        stopped=S.SAFE,
        reset=_FLYING,
    ),
    **_row(
        S.FAIL_MAJOR,
        auto=_FAILED,
        manual=_FAILED,
        minor=S.FAIL_MAJOR,
        stop=S.SAFE,
        stopped=S.SAFE,
        reset=_FLYING,
    ),
}


def after(state: SystemState, event: Event) -> Outcome:
    return TABLE[state, event]
