"""What of a stream one viewer is sent, and when. Pure: takes `now`.

Its laws, each with a test:
- A viewer has a place in the stream's newest group of pictures and no queue: what is not sent when the next key picture
  comes is never sent.
- What is begun is what can be decoded: after anything was left out, the next thing is a key picture.
- Nothing old is begun. What was sent and is not yet drawn (`got`) is bounded by what the way takes, so that what is
  begun arrives soon.
- A viewer who keeps up notices none of this.
"""

from collections import deque
from typing import Final

from server.video.core.streams import Relayed, Stream

PICTURE_AGE_S: Final = 0.35
KEY_AGE_S: Final = 0.4
"""Older ones are not begun: the group is given up, and the next key picture waited for."""
CATCH_UP_S: Final = 0.4
"""For a new viewer: the pictures before the present one are old and are drawn in a moment."""
FIRST_DRAWN_S: Final = 0.5
"""Who takes longer for the first picture is not led up to now, but waits for the next key."""
LEFT_OVER_S: Final = 0.2
"""The rest of a group may still go when the next one has begun, if it is no older than this."""
QUEUE_S: Final = 0.18
"""How long what is sent may wait on the way, beyond what the way takes at its best."""
PAUSE_S: Final = 0.09
"""Sends nothing while the oldest unacknowledged unit is overdue by this much."""
KEY_QUEUE_S: Final = 0.1
"""Before a key picture, which is large itself."""
KEY_PAUSE_S: Final = 0.03
"""Instead of PAUSE_S before a key picture that is large: were the way slow, all that follows would wait for it."""
LARGE_KEY_S: Final = 0.15
"""Takes this long at the stream's bit rate."""
KEY_DELAY_S: Final = 0.85
"""Skips a key picture that would be older than this on arrival, and begins with the next one."""
FRESH_S: Final = 0.05
"""A key picture that is no older is begun however long it takes."""
GOT_EVERY_S: Final = 0.075
"""A viewer may omit its `got` for pictures drawn within this time after the last one."""
TRUST_S: Final = 2.5
"""A calm viewer says so every two seconds. It is trusted for this long."""
OVERDUE_S: Final = 0.03
"""In place of PAUSE_S, once the viewer has reported an overdue picture."""
EACH_IN_A_ROW: Final = 4
"""After this many reports for single pictures, the viewer is assumed to report each one."""
LATE_S: Final = 0.12
"""So much later than at its best, and the way does not take the stream."""
FORGET_SLOW_S: Final = 1.0
"""After it was last late."""
IN_TIME_S: Final = 0.04
IN_TIME_AGAIN: Final = 3
"""Or after this many in a row that were late by no more than this: that was an interruption, not the line's rate."""
MAX_WAY_S: Final = 1.0
MAX_AHEAD_S: Final = 0.3
"""What the way itself holds counts for no more than this, once it is known to be slow."""
FIRST_GUESS_S: Final = 0.3
BEST_FOR_S: Final = 30.0
MAX_SENT: Final = 4096
_NOT_KNOWN: Final = float("inf")
_LONG_AGO: Final = float("-inf")

SentUnit = tuple[int, int, float]
"""(sequence, bytes, when)."""


class ViewerPace:
    """One for each viewer."""

    def __init__(self) -> None:
        self.skipped = 0
        """Units of its stream that it was too slow for."""
        self.in_flight = 0
        """Bytes sent and not yet reported as drawn."""
        self._stream: Stream | None = None
        self._group = 0
        self._next = 0
        self._due = 0
        """The unit that comes next, counted over all groups."""
        self._lost = False
        """Something of this group was left out."""
        self._catches_up_until = float("-inf")
        self._sent: deque[tuple[int, int, float, int]] = deque()
        """(sequence, bytes, when, delivered until then)."""
        self._delivered = 0
        self._drawn_sent_at = float("-inf")
        """When the newest was sent that it has drawn."""
        self.trusted_until = _LONG_AGO
        """Until then silence is good news: the viewer reports anything late."""
        self._is_overdue = False
        """The viewer waits for an overdue picture, until it reports that something arrived."""
        self.is_held_up = False
        """Something could be sent and is not, because earlier units are overdue. After a lost packet any new packet
        helps: only later packets show the other side that one is missing."""
        self._singles = 0
        """So many `got` in a row were for one picture each."""
        self._best_s = self._best_before_s = _NOT_KNOWN
        self._best_since = float("-inf")
        self._rate: float | None = None
        """Bytes a second that the way takes; None while it takes all."""
        self._late_at = float("-inf")
        self._in_time = 0
        """So many in a row."""

    def watch(self, stream: Stream, now: float) -> None:
        """From the newest key picture of this stream on."""
        self._stream = stream
        self._begin(stream)
        self._catches_up_until = now + CATCH_UP_S

    def next_unit(self, now: float) -> Relayed | None:
        """What is to be sent at once, if anything is; it counts as sent. Ask again until there is nothing."""
        stream = self._stream
        if stream is None:
            return None
        if now < self.trusted_until and self._group == stream.number and len(self._sent) < MAX_SENT:
            group, place = stream.group, self._next
            if place == len(group) - 1 and not self._lost and now - group[place].at < PICTURE_AGE_S:
                return self._send(group[place], now)  # what nearly always happens, and all that is done for it
        if self._group != stream.number:
            stays, left_over = self._left_over(stream, now)
            if stays:
                return left_over
        group = stream.group
        if self._lost or self._next >= len(group):
            return None
        unit = group[self._next]
        if now > self._catches_up_until and self._is_too_old(unit, now):
            self._lost = True
            return None
        return self._send(unit, now) if not self._sent or self._has_way_for(unit, now) else None

    def got(self, sequence: int, now: float, *, calm: bool = False, overdue: bool = False, held_s: float = 0.0) -> None:
        """The viewer has drawn this unit, and is done with all before it. Ignored for a unit that is not open.

        `calm`: nothing was late for a while, and it will report when something is. `overdue`: the next unit should have
        arrived. `held_s`: time between drawing and reporting.
        """
        self._is_overdue, self.is_held_up = overdue, False
        if not calm and self.trusted_until != _LONG_AGO:
            self.trusted_until = _LONG_AGO
            self._reckon_what_came()
        sent = self._sent
        if not sent or (sent[0][0] != sequence and all(one[0] != sequence for one in sent)):
            return
        self._singles = self._singles + 1 if sent[0][0] == sequence else 0
        while True:
            number, size, at, delivered = sent.popleft()
            self.in_flight -= size
            self._delivered += size
            if number == sequence:
                break
        took_s = max(0.0, now - at - held_s)
        self._drawn_sent_at = at
        if self._best_s == _NOT_KNOWN and took_s < FIRST_DRAWN_S:
            self._catches_up_until = max(self._catches_up_until, now + CATCH_UP_S)
        self._note_best(took_s, now)
        sample = (self._delivered - delivered) / max(took_s, 1e-3)
        if calm and took_s < TRUST_S:  # who goes on drawing what is older than that is not calm
            self.trusted_until, self._rate = now + TRUST_S, None
            return
        late_s = took_s - self._best()
        self._in_time = self._in_time + 1 if late_s < IN_TIME_S else 0
        if late_s > LATE_S:
            self._late_at = now
            self._rate = sample if self._rate is None else max(sample, 0.7 * self._rate + 0.3 * sample)
        elif self._rate is not None:
            over = self._in_time >= IN_TIME_AGAIN or now - self._late_at > FORGET_SLOW_S
            self._rate = None if over else max(self._rate, sample)

    def _reckon_what_came(self) -> None:
        """A calm viewer does not report arrivals: units older than the usual time have arrived."""
        best, reckoned, came = self._best(), self._delivered, 0
        sent = list(self._sent)
        for place, (number, size, at, _) in enumerate(sent):
            while sent[came][2] <= at - best and came < place:
                reckoned += sent[came][1]
                came += 1
            self._sent[place] = (number, size, at, reckoned)

    # -- in step -----------------------------------------------------------------------------------------------

    def is_in_step(self, now: float) -> bool:
        """Calm and fully served: the next unit can be sent without a check."""
        stream = self._stream
        return (
            stream is not None
            and now < self.trusted_until
            and self._group == stream.number
            and self._next == len(stream.group) > 0
            and not self._lost
            and len(self._sent) < MAX_SENT
        )

    def was_in_step(self, sent: list[SentUnit], behind: int) -> None:
        """Since it was found in step it was `sent` these without a check, and not the newest `behind` units."""
        for number, size, at in sent:
            self._sent.append((number, size, at, self._delivered))
            self.in_flight += size
        stream = self._stream
        if stream is None:
            return
        here, before = len(stream.group), len(stream.previous)
        if behind <= here:
            self._group, self._next = stream.number, here - behind
        elif behind <= here + before:
            self._group, self._next = stream.number - 1, here + before - behind
        else:
            self._group = stream.number - 2  # so far behind that only the newest group is of use
        self._due = stream.began + here - behind
        self._lost = False

    def silent_for(self, now: float) -> float:
        """Seconds since the oldest unreported unit was sent; 0 if there is none."""
        return now - self._sent[0][2] if self._sent else 0.0

    # -- what the way takes ----------------------------------------------------------------------------------

    def _has_way_for(self, unit: Relayed, now: float) -> bool:
        if now < self.trusted_until:
            return len(self._sent) < MAX_SENT
        self.is_held_up = False
        best = self._best()
        head, size = unit.head, len(unit.framed)
        pause_s = KEY_PAUSE_S if head.key and size > LARGE_KEY_S * head.bits_per_s / 8 else PAUSE_S
        said_of = self._sent[0][2]
        if self._is_overdue:
            pause_s = OVERDUE_S
        elif self._singles < EACH_IN_A_ROW:
            said_of = max(said_of, self._drawn_sent_at + GOT_EVERY_S + 1 / head.rate_hz)
            pause_s /= 2
        if now - said_of > best + pause_s or len(self._sent) >= MAX_SENT:
            self.is_held_up = self._rate is None
            return False
        if self._best_s == _NOT_KNOWN:
            return False  # whether the way takes anything is not known before the first picture was drawn
        if self._rate is None:
            at_once = head.bits_per_s / 8 * (best + QUEUE_S) + self._key_bytes()
            return self.in_flight + size <= at_once
        best = min(best, MAX_AHEAD_S)
        if head.key:
            return self.in_flight <= self._rate * (best + KEY_QUEUE_S)
        return self.in_flight + size <= self._rate * (best + QUEUE_S)

    def _is_too_old(self, unit: Relayed, now: float) -> bool:
        age_s = now - unit.at
        if not unit.head.key:
            return age_s > PICTURE_AGE_S
        if self._rate is None or age_s <= FRESH_S:
            return age_s > KEY_AGE_S
        takes_s = (self.in_flight + len(unit.framed)) / self._rate + min(self._best(), MAX_AHEAD_S) / 2
        return age_s > KEY_AGE_S or age_s + takes_s > KEY_DELAY_S

    def _key_bytes(self) -> int:
        group = self._stream.group if self._stream is not None else ()
        return len(group[0].framed) if group else 0

    def _best(self) -> float:
        best = self._best_s if self._best_s < self._best_before_s else self._best_before_s
        if best > MAX_WAY_S:
            return FIRST_GUESS_S if best == _NOT_KNOWN else MAX_WAY_S
        return best

    def _note_best(self, took_s: float, now: float) -> None:
        if now - self._best_since > BEST_FOR_S:
            self._best_before_s, self._best_s, self._best_since = self._best_s, took_s, now
        elif took_s < self._best_s:
            self._best_s = took_s

    # -- its place -------------------------------------------------------------------------------------------

    def _left_over(self, stream: Stream, now: float) -> tuple[bool, Relayed | None]:
        """(whether it stays with the group before, what of it is to be sent now)."""
        before = stream.previous if self._group == stream.number - 1 else ()
        if self._next < len(before):
            unit = before[self._next]
            fresh = not self._lost and now - unit.at <= LEFT_OVER_S
            if fresh and (not self._sent or self._has_way_for(unit, now)):
                return True, self._send(unit, now)
            if fresh and self._rate is None:
                return True, None  # it is a moment's stop, not a slow way
        self.skipped += stream.began - self._due
        self._begin(stream)
        return False, None

    def _begin(self, stream: Stream) -> None:
        self._group, self._next, self._lost = stream.number, 0, False
        self._due = stream.began

    def _send(self, unit: Relayed, now: float) -> Relayed:
        size = len(unit.framed)
        self._sent.append((unit.head.sequence, size, now, self._delivered))
        self.in_flight += size
        self._next += 1
        self._due += 1
        return unit
