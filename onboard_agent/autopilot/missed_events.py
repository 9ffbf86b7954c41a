"""Asks the autopilot for events that did not arrive, and sees to it that the tower gets them. No I/O; takes `now`.

PX4 reports its arming checks once for each change, and keeps the newest 20 events. A lost event is a reason that nobody
reads; a tower that was not there heard none of them. What is asked for passes to the tower as any other event.

Rules, each tested:
- A gap below the newest sequence (of an event, or of CURRENT_EVENT_SEQUENCE) is asked for, ASK_TIMES at most.
- All that the autopilot keeps is asked for once when it is first heard, when a link to a tower opens, and AGAIN_S after
  the last new event, because the way to the tower loses frames too.
- What the autopilot says that it has no more is not asked for again.
- A new event is followed by a request for a heartbeat. PX4 sends one a second; who disarms, or enters a failsafe, tells
  an event at once.
"""

from struct import Struct
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, request_message
from wire.autopilots.event_log import EventLog, ahead, before
from wire.dialect import CURRENT_EVENT_SEQUENCE, EVENT, EVENT_ERROR, RequestEvent, mavlink
from wire.frames import payload

READS: Final = frozenset({EVENT, CURRENT_EVENT_SEQUENCE, EVENT_ERROR})
KEPT_BY_AUTOPILOT: Final = 20
GAP_S: Final = 0.3
ASK_EVERY_S: Final = 0.5
ASK_TIMES: Final = 3
AGAIN_S: Final = 3.0
LOOK_EVERY_S: Final = 0.1
"""Events come in bursts."""

_CURRENT: Final = Struct("<HB")
_ERROR: Final = Struct("<HHBBB")
_RESET: Final = 1
_AUTOPILOT: Final = 1


class MissedEvents:
    """Feed it the frames of READS that the autopilot sends; call `due` at each tick."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._log = EventLog()
        self._told: int | None = None
        """The newest sequence that the autopilot has named."""
        self._asked: dict[int, int] = {}
        self._gone: set[int] = set()
        self._ask_at = 0.0
        self._again_at: float | None = None
        self._looks = False
        self._look_at = 0.0

    def receive(self, msgid: int, frame: bytes, now: float) -> bool:
        """Whether the frame is an event that is new here."""
        if msgid == EVENT:
            return self._event(frame, now)
        if msgid == CURRENT_EVENT_SEQUENCE:
            sequence, flags = _CURRENT.unpack(payload(frame)[: _CURRENT.size].ljust(_CURRENT.size, b"\0"))
            if flags & _RESET and self._told is not None and ahead(sequence, self._told) < 0:
                self._restarted()
            self._tell(sequence, now)
        elif msgid == EVENT_ERROR:
            sequence, *_ = _ERROR.unpack(payload(frame)[: _ERROR.size].ljust(_ERROR.size, b"\0"))
            self._gone.add(sequence)
        return False

    def link_up(self, now: float) -> None:
        """A tower is there that may have heard none of them."""
        self._again_at = now

    def due(self, now: float, *, vehicle_system_id: int) -> list[bytes]:
        """Requests to send now."""
        return [*self._look(now, vehicle_system_id), *self._ask(now, vehicle_system_id)]

    def _look(self, now: float, vehicle_system_id: int) -> list[bytes]:
        if not self._looks or now < self._look_at:
            return []
        self._looks, self._look_at = False, now + LOOK_EVERY_S
        ask = request_message(vehicle_system_id, mavlink.MAVLINK_MSG_ID_HEARTBEAT, confirmation=0)
        return [self._maker.make(ask, agent_sender(vehicle_system_id))]

    def _ask(self, now: float, vehicle_system_id: int) -> list[bytes]:
        if self._told is None or now < self._ask_at:
            return []
        if self._again_at is not None and now >= self._again_at:
            self._again_at = None
            self._ask_at = now + ASK_EVERY_S
            return [self._request(before(self._told, KEPT_BY_AUTOPILOT - 1), self._told, vehicle_system_id)]
        missing = self._missing()
        if not missing:
            return []
        self._ask_at = now + ASK_EVERY_S
        for sequence in missing:
            self._asked[sequence] = self._asked.get(sequence, 0) + 1
        return [self._request(missing[0], missing[-1], vehicle_system_id)]

    def _event(self, frame: bytes, now: float) -> bool:
        newest = self._log.newest
        if not self._log.take(frame):
            return False
        assert self._log.newest is not None
        if newest is not None and newest not in self._log:
            self._restarted(keeps_log=True)
        self._tell(self._log.newest, now)
        self._again_at = now + AGAIN_S
        self._looks = True
        return True

    def _tell(self, sequence: int, now: float) -> None:
        if self._told is None:
            self._again_at = now
        elif ahead(sequence, self._told) <= 0:
            return
        self._told = sequence
        self._ask_at = max(self._ask_at, now + GAP_S)  # what follows at once is not missed

    def _restarted(self, *, keeps_log: bool = False) -> None:
        if not keeps_log:
            self._log.forget()
        self._told = None
        self._asked.clear()
        self._gone.clear()

    def _missing(self) -> list[int]:
        """The first run of sequences that should have come."""
        assert self._told is not None
        run: list[int] = []
        oldest = self._oldest()
        for count in range(ahead(self._told, oldest), -1, -1):
            sequence = before(self._told, count)
            wanted = sequence not in self._log and sequence not in self._gone
            if wanted and self._asked.get(sequence, 0) < ASK_TIMES:
                run.append(sequence)
            elif run:
                break
        self._asked = {one: times for one, times in self._asked.items() if ahead(one, oldest) >= 0}
        self._gone = {one for one in self._gone if ahead(one, oldest) >= 0}
        return run

    def _oldest(self) -> int:
        """The autopilot keeps none before it."""
        assert self._told is not None
        return before(self._told, KEPT_BY_AUTOPILOT - 1)

    def _request(self, first: int, last: int, vehicle_system_id: int) -> bytes:
        ask: Any = RequestEvent(first, last, vehicle_system_id, _AUTOPILOT)
        return self._maker.make(ask, agent_sender(vehicle_system_id))
