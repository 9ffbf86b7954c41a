"""The commander: the only one that changes the state of the flight controller, and the only way to arm.

`update` is called some ten times a second with the flags as they are; requests come in between. Texts for STATUSTEXT
are queued in `texts`, oldest first.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from simulator.firmware.health import (
    LANDS_AFTER_S,
    TOO_LONG,
    Fault,
    Health,
    Weight,
    check_init,
    check_run_auto,
    check_run_manual,
    check_startup,
    worst,
)
from simulator.firmware.states import FLYING, Event, Refusal, SystemState, after
from simulator.notices import Notice, Severity

MAX_TEXTS = 64
RECOVERED_AFTER_S = 1.0
"""A minor fault must be gone for so long: one that comes and goes is not recovered from ten times a second."""


class RequestRefused(ValueError):
    """The commander does not do this now; the text says why."""


@dataclass(slots=True)
class Commander:
    health: Health = field(default_factory=Health)
    state: SystemState = SystemState.INIT
    texts: deque[Notice] = field(default_factory=lambda: deque(maxlen=MAX_TEXTS))
    """The oldest is given up first: a newer one says more about the present."""
    faults: tuple[Fault, ...] = ()
    """As of the last update."""
    manual: bool = False
    """Whether sticks fly, or flew before a minor fault."""
    _good_since_s: float | None = None
    _since_s: dict[str, float] = field(default_factory=dict)
    """Since when minor faults with a limit last."""

    # Requests.

    def auto(self) -> None:
        """Arms, or changes from manual. Raises RequestRefused."""
        self._request(Event.AUTO_REQUESTED, check_run_auto(self.health))
        self.manual = False

    def run_manual(self) -> None:
        """Arms, or changes from auto. Raises RequestRefused."""
        self._request(Event.MANUAL_REQUESTED, check_run_manual(self.health))
        self.manual = True

    def stop(self) -> None:
        """Disarms."""
        self._event(Event.STOP_REQUESTED)

    def motors_stopped(self) -> None:
        self._event(Event.MOTORS_STOPPED)

    def reset(self) -> None:
        """Starts again from SYS_INIT. Raises RequestRefused while armed."""
        outcome = after(self.state, Event.RESET)
        if isinstance(outcome, Refusal):
            raise RequestRefused(outcome.reason)
        self._event(Event.RESET)

    def _request(self, event: Event, faults: list[Fault]) -> None:
        outcome = after(self.state, event)
        if isinstance(outcome, Refusal):
            raise RequestRefused(outcome.reason)
        if self.state is SystemState.SAFE:
            faults = [*check_init(self.health), *check_startup(self.health), *faults]
            if faults:
                raise RequestRefused(faults[0].text)
        self._event(event)

    # Time.

    def update(self, now_s: float) -> None:
        """Runs the checks of the present state, reports what is new, and acts on it."""
        faults = self._checked()
        if self._lasts_too_long(faults, now_s):
            faults.append(TOO_LONG)
        for fault in faults:
            if fault not in self.faults:
                grave = fault.weight is Weight.MAJOR
                self.texts.append(Notice(Severity.CRITICAL if grave else Severity.ERROR, fault.text))
        self.faults = tuple(faults)
        weight = worst(faults)
        if self.state is SystemState.INIT and weight is None:
            self._event(Event.INIT_PASSED)
        elif self.state is SystemState.STARTUP and weight is None:
            self._event(Event.STARTUP_PASSED)
        elif self.state in FLYING:
            self._judge_flight(weight, now_s)

    def _checked(self) -> list[Fault]:
        health = self.health
        if self.state is SystemState.INIT:
            return check_init(health)
        if self.state is SystemState.STARTUP:
            return [*check_init(health), *check_startup(health)]
        checks = [*check_init(health), *check_startup(health)]
        if self.state is SystemState.SAFE:
            return checks
        run = check_run_manual(health) if self.manual else check_run_auto(health)
        return list(dict.fromkeys((*checks, *run)))

    def _lasts_too_long(self, faults: list[Fault], now_s: float) -> bool:
        limited = [fault.text for fault in faults if fault.text in LANDS_AFTER_S and self.state in FLYING]
        self._since_s = {text: self._since_s.get(text, now_s) for text in limited}
        return any(now_s - since_s >= LANDS_AFTER_S[text] for text, since_s in self._since_s.items())

    def _judge_flight(self, weight: Weight | None, now_s: float) -> None:
        if weight is Weight.MAJOR and self.state is not SystemState.FAIL_MAJOR:
            self._event(Event.MAJOR_FAULT)
        elif weight is Weight.MINOR and self.state is not SystemState.FAIL_MAJOR:
            self._good_since_s = None
            if self.state is not SystemState.FAIL_MINOR:
                self._event(Event.MINOR_FAULT)
        elif weight is None and self.state is SystemState.FAIL_MINOR:
            if self._good_since_s is None:
                self._good_since_s = now_s
            elif now_s - self._good_since_s >= RECOVERED_AFTER_S:
                self._good_since_s = None
                self.texts.append(Notice(Severity.NOTICE, "Recovered"))
                self._event(Event.RECOVERED_TO_MANUAL if self.manual else Event.RECOVERED_TO_AUTO)

    def _event(self, event: Event) -> None:
        outcome = after(self.state, event)
        if isinstance(outcome, Refusal) or outcome is self.state:
            return
        self.state = outcome
        self.health.armed = outcome in FLYING
        self.texts.append(Notice(Severity.INFO, outcome.value))
