"""Requests flight modes from the autopilot in order of preference until it is in one of them. No I/O.

Rules, each tested:
- A mode is confirmed only when a COMMAND_ACK has accepted it *and* a heartbeat after the request shows it. A mode that
  the autopilot's own failsafe has chosen proves nothing, though it has the same name: PX4 leaves it after some seconds.
- A request is repeated every RETRY_S. The next rung follows at once when the autopilot refuses a rung, or when the rung
  is not confirmed within the ladder's patience. The last rung is never left, but after a while requested more slowly.
- PX4 answers twice: what receives the message accepts it, then what flies answers. So a refusal after an acceptance
  counts.
- COMMAND_ACK does not name its mode, so responses are matched with requests in order. If several rungs wait for a
  response, an acceptance may belong to any of them, and the next heartbeat shows to which.
- A rung that is shown while a later one waits for its response is requested again: the autopilot obeys in order, and
  the later request takes it out of this mode. It happens on a slow line, or after this process did not run for a while.
- An autopilot that takes the request as COMMAND_INT only gets it so at once.
- For an accepted mode that is not shown yet, a HEARTBEAT is requested: ArduPilot sends one at once when its mode
  changes, PX4 waits for the next second, and neither sends one if the mode did not change.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, NamedTuple

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, request_message, set_mode
from wire.autopilots.command_messages import as_the_other
from wire.autopilots.profile import FlightMode, Sticks
from wire.dialect import mavlink

RETRY_S: Final = 0.25
LATE_RETRY_S: Final = 1.0
"""Retries continue, but slowly enough not to flood a slow line."""
FAST_FOR_S: Final = 3.0
IN_PROGRESS_WAIT_S: Final = 1.0
STALLED_S: Final = 0.2
"""Several ticks. What a pause lasts longer is this process's own: responses wait to be read meanwhile. So much of each
pause counts, or a computer that is always slow would never leave a rung."""
SHOW_RETRY_S: Final = 0.05
"""Interval of HEARTBEAT requests, since the first may precede the mode change. Applies within the patience for a rung;
later each mode request brings one."""


_NO_REFUSAL: Final = (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS)


class LadderStep(StrEnum):
    """Progress of one rung."""

    REQUESTED = "requested"
    ACCEPTED = "accepted"
    CONFIRMED = "confirmed"


class Reached(NamedTuple):
    """A step and its description, which begins with the mode's name."""

    step: LadderStep
    detail: str


@dataclass
class _Rung:
    mode: FlightMode
    requests: int = 0
    accepted: bool = False
    refusal: str = ""

    def why_not(self) -> str:
        if self.accepted:
            return f"{self.mode.name} was accepted, but the heartbeat does not show it"
        if self.refusal:
            return f"the autopilot refuses {self.mode.name}: {self.refusal}"
        return f"no answer from the autopilot to {self.mode.name}"


class ModeLadder:
    """Call `climb`, then `due` at each tick; feed it acknowledgements and heartbeats; call `pop_reached` after each."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._rungs: list[_Rung] = []
        self._unanswered: list[_Rung] = []
        """One for each request, oldest first."""
        self._current = 0
        self._again = False
        """Whether the current rung is to be requested again at once."""
        self._asking = False
        self._as_int = False
        self._keeps_shown = False
        self._patience_s = 0.0
        self._began_at = 0.0
        self._leave_at = 0.0
        self._next_request_at = 0.0
        self._next_show_at = 0.0
        self._looked_at = 0.0
        self._shown: int | None = None
        self._reached: list[Reached] = []
        self.confirmed: FlightMode | None = None
        """The rung that was confirmed last."""

    def climb(self, modes: Sequence[FlightMode], *, patience_s: float, now: float, keeps_shown: bool = False) -> None:
        """Starts at the first rung. Earlier requests are forgotten.

        `keeps_shown`: a rung that heartbeats show is not left because its response is missing. Use it only if the drone
        was in none of these modes before.
        """
        self._keeps_shown = keeps_shown
        self._rungs = [_Rung(mode) for mode in modes]
        self._unanswered.clear()
        self._asking = bool(modes)
        self._patience_s = patience_s
        self._began_at = self._looked_at = now
        self._current = 0
        self._shown = None
        self._reached = []
        self._begin_rung(now)

    def stop(self) -> None:
        """Stops requesting."""
        self._asking = False

    @property
    def asking(self) -> bool:
        """Whether a mode is requested and not yet confirmed."""
        return self._asking

    @property
    def current(self) -> FlightMode | None:
        """The mode that is requested now."""
        return self._rungs[self._current].mode if self._asking else None

    @property
    def all_refuse(self) -> bool:
        """Whether the autopilot has refused every rung and accepted none."""
        return all(rung.refusal and not rung.accepted for rung in self._rungs)

    def due(self, now: float, *, vehicle_system_id: int) -> list[bytes]:
        """Requests to send now."""
        if not self._asking:
            return []
        self._leave_at += max(0.0, now - self._looked_at - STALLED_S)
        self._looked_at = now
        if self._again:
            self._begin_rung(now)
        rung = self._rungs[self._current]
        patient = self._keeps_shown and self._shown == rung.mode.custom_mode
        if rung.requests and now >= self._leave_at and not self._on_last_rung and not patient:
            rung = self._next_rung(now)
        messages: list[Any] = []
        asks = now >= self._next_request_at
        if asks:
            late = now - self._began_at >= FAST_FOR_S
            self._next_request_at = now + (LATE_RETRY_S if late else RETRY_S)
            asked = set_mode(vehicle_system_id, rung.mode.command_parameters, confirmation=rung.requests)
            # A mode has no place, so it is the same in both messages whatever the autopilot.
            messages.append(as_the_other(asked, autopilot_kind=0) if self._as_int else asked)
            rung.requests += 1
            self._unanswered.append(rung)
            if rung.requests == 1:
                before = f" ({self._rungs[self._current - 1].why_not()})" if self._current else ""
                self._reached.append(Reached(LadderStep.REQUESTED, rung.mode.name + before))
        if rung.accepted and (asks or self._next_show_at <= now < self._leave_at):
            self._next_show_at = now + SHOW_RETRY_S
            messages.append(request_message(vehicle_system_id, mavlink.MAVLINK_MSG_ID_HEARTBEAT, confirmation=0))
        return [self._maker.make(message, agent_sender(vehicle_system_id)) for message in messages]

    def acknowledged(self, ack: Any, now: float) -> None:
        """Handles a COMMAND_ACK for MAV_CMD_DO_SET_MODE that is addressed to the agent."""
        if not self._asking:
            return
        if not self._unanswered:
            self._take_back(ack.result, now)
            return
        if ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            self._next_request_at = now + IN_PROGRESS_WAIT_S
            self._leave_at = max(self._leave_at, now + IN_PROGRESS_WAIT_S)
            return
        waiting, newest = list(self._unanswered), self._unanswered[-1]
        oldest = self._unanswered.pop(0)
        if ack.result == mavlink.MAV_RESULT_COMMAND_INT_ONLY and not self._as_int:
            self._as_int, self._next_request_at = True, now
            return
        if ack.result != mavlink.MAV_RESULT_ACCEPTED:
            oldest.refusal = result_name(ack.result)
            if oldest is self._rungs[self._current] and not self._on_last_rung:
                self._next_rung(now)
            return
        known = newest.accepted
        for rung in waiting:
            rung.accepted = True
        if not known:
            self._reached.append(Reached(LadderStep.ACCEPTED, newest.mode.name))
        # A mode shown before this response confirms only the newest rung: the response may belong to another one.
        if self._shown == newest.mode.custom_mode:
            self._confirm(newest)

    def _take_back(self, result: int, now: float) -> None:
        """Handles a second answer to the newest request."""
        rung = self._rungs[self._current]
        if not rung.accepted or result in _NO_REFUSAL:
            return
        rung.accepted, rung.refusal = False, result_name(result)
        # A mode with sticks is refused while the first ones have only just arrived: it is requested again.
        if not self._on_last_rung and rung.mode.sticks is Sticks.IGNORED:
            self._next_rung(now)

    def heartbeat(self, custom_mode: int, *, by_failsafe: bool = False) -> None:
        """A HEARTBEAT of the autopilot, armed. `by_failsafe`: its own failsafe has chosen this mode."""
        if not self._asking:
            return
        shown = [rung for rung in self._rungs if rung.mode.custom_mode == custom_mode]
        if by_failsafe and any(rung.mode.sticks is Sticks.IGNORED for rung in shown):
            self._shown = None
            return
        self._shown = custom_mode
        for rung in shown:
            if rung.accepted:
                self._confirm(rung)
                return

    def why_not(self) -> str:
        """Explains for each rung why it is not confirmed."""
        return "; ".join(rung.why_not() for rung in self._rungs if rung.requests)

    def pop_reached(self) -> list[Reached]:
        """The steps since the last call, in order."""
        reached, self._reached = self._reached, []
        return reached

    @property
    def _on_last_rung(self) -> bool:
        return self._current == len(self._rungs) - 1

    def _next_rung(self, now: float) -> _Rung:
        self._current += 1
        self._begin_rung(now)
        return self._rungs[self._current]

    def _begin_rung(self, now: float) -> None:
        self._again = False
        self._next_request_at = self._next_show_at = now
        self._leave_at = now + self._patience_s

    def _confirm(self, rung: _Rung) -> None:
        if self._unanswered and self._unanswered[-1] is not rung:
            earlier = self._rungs.index(rung)
            if earlier < self._current:
                self._current, self._again, rung.accepted = earlier, True, False
            return
        self._asking = False
        self.confirmed = rung.mode
        self._reached.append(Reached(LadderStep.CONFIRMED, rung.mode.name))


def result_name(result: int) -> str:
    """MAV_RESULT in words."""
    entry = mavlink.enums["MAV_RESULT"].get(result)
    return str(entry.name).removeprefix("MAV_RESULT_") if entry is not None else f"result {result}"
