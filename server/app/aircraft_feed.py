"""Polls the network feed of aircraft and hands it to the hub."""

from __future__ import annotations

import asyncio
import time
from typing import Final

import structlog

from server.airspace.core.aircraft.feed import reports_in
from server.airspace.core.aircraft.service import AircraftService
from server.airspace.io import read_feed
from server.runtime.aligned_timers import rest

POLL_S: Final = 1.0
_log = structlog.get_logger(__name__)


class AircraftFeed:
    """`address`: a path or an http address; see `TOWER_TRAFFIC_FEED`."""

    def __init__(self, address: str, aircraft: AircraftService) -> None:
        self._address = address
        self._aircraft = aircraft

    async def follow(self) -> None:
        """Runs until cancelled. A feed that fails is said once, and again when it is back."""
        works = True
        while True:
            await rest(POLL_S)
            try:
                content = await asyncio.to_thread(read_feed, self._address)
                now = time.monotonic()
                reports = await asyncio.to_thread(reports_in, content, now)
            except (OSError, ValueError) as error:
                if works:
                    _log.warning("aircraft_feed_lost", error=str(error)[:200])
                works = False
                continue
            if not works:
                _log.info("aircraft_feed_back")
            works = True
            self._aircraft.feed(reports, now)
