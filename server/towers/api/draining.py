"""Ends the work of one tower among several without a gap for those who fly (`tower drain`).

Takes no new links and browsers, sends the drones to the other towers, hand-flown ones last (server.towers.core.drain),
then the browsers, and then ends the process.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Final

import structlog

from server.live.browser import Browser
from server.live.hub import GOING_DOWN, Hub
from server.live.live_drone import LiveDrone
from server.live.live_messages import LeaveTower
from server.towers.core.drain import Drain, Linked, Step
from server.towers.core.place import Place
from server.towers.core.towers import Towers
from wire.tower_list import TOWERS

TICK_S: Final = 0.1
TOLD_AGAIN_AFTER_S: Final = 2.0
BROWSERS_LEAVE_WITHIN_S: Final = 10.0
"""Then the connections are closed, but for those of people who fly by hand."""
_log = structlog.get_logger(__name__)


class Draining:
    """One run. `report`: how far it is, for people."""

    def __init__(self, hub: Hub, towers: Towers, *, report: Callable[[str], None]) -> None:
        self._hub = hub
        self._towers = towers
        self._report = report
        self._drain = Drain()

    async def run(self) -> None:
        """Returns when nobody is left."""
        _log.warning("drain_began", links=len(self._hub.state.links), browsers=len(self._own_browsers()))
        self._hub.links.takes_new = self._hub.takes_browsers = False
        while self._hub.state.links:
            self._move_drones(time.monotonic())
            await asyncio.sleep(TICK_S)
        began_at, told_at = time.monotonic(), float("-inf")
        while browsers := self._own_browsers():
            now = time.monotonic()
            self._report(self._drain.in_words([], len(browsers)))
            if now - told_at >= TOLD_AGAIN_AFTER_S:
                told_at = now
                for one in browsers:
                    one.notify(LeaveTower())
            if now - began_at >= BROWSERS_LEAVE_WITHIN_S:
                flies = self._towers.visits.flies_by_hand
                for one in browsers:
                    if not flies(one.number, now):
                        one.close(GOING_DOWN, "this tower ends its work")
            await asyncio.sleep(TICK_S)
        self._report(self._drain.in_words([], 0))
        _log.warning("drain_done")

    def _own_browsers(self) -> list[Browser]:
        return [one for one in self._hub.state.browsers.values() if not one.is_visitor]

    def _move_drones(self, now: float) -> None:
        state = self._hub.state
        linked = [self._linked(state.drones[link.drone_id], now) for link in state.links.values()]
        self._report(self._drain.in_words(linked, len(self._own_browsers())))
        for link_id, step in self._drain.due(linked, now):
            link = state.links[link_id]
            if step is Step.CLOSE:
                link.close(GOING_DOWN, "this tower ends its work")
                self._hub.detach_link(link)
                continue
            drone = state.drones[link.drone_id]
            if drone.place is Place.HERE and self._is_settled(drone):
                self._towers.hand_over(drone.drone_id, drone.lease.epoch)
            self._hub.links.send_away(link)

    def _linked(self, drone: LiveDrone, now: float) -> Linked:
        link = drone.link
        assert link is not None
        return Linked(
            link_id=link.link_id,
            name=drone.record.name,
            by_hand=drone.flown_by_hand(now),
            settled=self._is_settled(drone),
            can_move=TOWERS in link.takes and bool(self._hub.links.towers),
        )

    @staticmethod
    def _is_settled(drone: LiveDrone) -> bool:
        return (
            not drone.fenced
            and not drone.open_hold.must_be_ordered
            and drone.lease.assistant is None
            and (drone.lease.holder is None or drone.somebody_flies())
        )
