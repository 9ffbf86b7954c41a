"""Decides when an agent looks for another tower while it still has a link. No I/O; takes `now`.

    the tower                                              result
    sends its drones away (TowerList.leave)                look, and leave once another one has answered
    silent on datagrams for LOOK_AFTER_S                   connect to another one, and ask this one once more
    still silent PROOF_S after that, on both channels      leave
    heard meanwhile                                        stay

A short outage of the drone's own network ends for all towers at the same time: hence the proof. It is measured from the
moment at which another tower could be reached.
"""

from typing import Final

LOOK_AFTER_S: Final = 1.2
"""Two keep-alives in a row, and the answers to as many, are missing."""
PROOF_S: Final = 0.6
"""A tower that is there answers a keep-alive within this time: its interval is 0.5 s."""
AGAIN_AFTER_S: Final = 0.5


class TowerLeaving:
    """One for each control channel."""

    def __init__(self) -> None:
        self._sent_away = False
        self._next_at = float("-inf")

    def sent_away(self) -> None:
        """The tower has asked the agent to leave."""
        self._sent_away = True

    @property
    def is_sent_away(self) -> bool:
        return self._sent_away

    def wants_to_look(self, *, silent_s: float, now: float) -> bool:
        """Whether to try the other towers now. `silent_s`: time since the last datagram of this one."""
        return now >= self._next_at and (self._sent_away or silent_s > LOOK_AFTER_S)

    def failed(self, now: float) -> None:
        """No other tower could be reached, or this one was heard again."""
        self._next_at = now + AGAIN_AFTER_S

    def may_go(self, *, heard_since_reached: bool) -> bool:
        """Asked PROOF_S after another tower was reached. `heard_since_reached`: this one, on any channel."""
        return self._sent_away or not heard_since_reached
