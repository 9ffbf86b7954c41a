"""Measures the tower itself, for the alerts about it: its disks, its TLS certificate, its pace."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from datetime import datetime
from functools import partial
from typing import Final
from urllib.parse import urlsplit

import structlog

from server.alerts.core.service import AlertService
from server.alerts.core.tower_facts import Certificate, Disk, PartFails, StoodStill, StoredThere, TowerFacts
from server.alerts.io.sending_threads import SendingThreads
from server.link.api.fault_log import FaultLog
from server.runtime.loop_watch import LoopWatch
from server.runtime.settings import Settings
from server.runtime.tower_condition import disk_space, shown_certificate_ends_at, stored_certificate_ends_at
from server.storage.integrity import fault_in, sqlite_file

EVERY_S: Final = 15.0
ROUNDS: Final = 40
"""The certificate is read once in so many rounds: every ten minutes."""
DATABASE_ROUNDS: Final = 5760
"""And the file of the database: every day."""
_log = structlog.get_logger(__name__)


class TowerWatch:
    """One instance per tower."""

    def __init__(self, settings: Settings, alerts: AlertService, loop_watch: LoopWatch, faults: FaultLog) -> None:
        self._settings = settings
        self._alerts = alerts
        self._loop_watch = loop_watch
        self._faults = faults
        self._threads = SendingThreads()
        """A disk that does not answer, or a slow proxy, must not keep the tower from stopping."""
        self._problem = ""
        self._database_fault = ""

    async def work(self) -> None:
        """Runs until cancelled."""
        round_number = 0
        while True:
            await self.measure(with_certificate=round_number % ROUNDS == 0)
            if round_number % DATABASE_ROUNDS == 0:
                await self.check_database()
            round_number += 1
            await asyncio.sleep(EVERY_S)

    async def check_database(self) -> None:
        """Reads the whole file, beside all other work."""
        file = sqlite_file(self._settings.database_url)
        if file is None:
            return
        found: list[str] = []
        await self._threads.start(0, lambda: found.append(fault_in(file, whole=False)))
        if found[0] and not self._database_fault:
            _log.error("database_damaged", file=str(file), fault=found[0])
        self._database_fault = found[0]

    async def measure(self, *, with_certificate: bool) -> None:
        """Without the certificate, the end of the one that was read last counts."""
        certificate = self._alerts.tower_facts.certificate
        found: list[TowerFacts] = []
        worst = self._faults.worst()

        def look() -> None:
            ends = self._certificate() if with_certificate else certificate
            low = self._settings.disk_low_mb * 1_000_000
            held = self._loop_watch.worst_hold()
            still = None if held is None else StoodStill(held.held_s, held.where)
            found.append(
                TowerFacts(
                    disk=self._disk(),
                    disk_low_bytes=low,
                    certificate=ends,
                    stood_still=still,
                    database_fault=self._database_fault,
                    failing=None if worst is None else PartFails(*worst),
                )
            )

        await self._threads.start(0, look)
        self._alerts.tower_facts = found[0]

    def _disk(self) -> Disk | None:
        try:
            var, files = disk_space(self._settings.var), disk_space(self._settings.files)
        except OSError:
            return None
        if var.device == files.device:
            return Disk(StoredThere.BOTH, var.free_bytes)
        of_both = Disk(StoredThere.DATA, var.free_bytes), Disk(StoredThere.FILES, files.free_bytes)
        return min(of_both, key=lambda disk: disk.free_bytes)

    def _certificate(self) -> Certificate | None:
        settings, problem, found = self._settings, "", list[Certificate]()
        sources: list[tuple[str, Callable[[], datetime]]] = []
        if settings.tls_certificate is not None:
            sources.append(
                (str(settings.tls_certificate), partial(stored_certificate_ends_at, settings.tls_certificate))
            )
        if settings.certificate_address:
            name = urlsplit(settings.public_url).hostname or ""
            sources.append(
                (settings.certificate_address, partial(shown_certificate_ends_at, settings.certificate_address, name))
            )
        for where, ends_at in sources:
            try:
                found.append(Certificate(where, ends_at()))
            except (OSError, ValueError) as error:
                problem = f"{where}: {error or type(error).__name__}"
        if problem != self._problem:
            self._problem = problem
            if problem:
                _log.warning("certificate_not_read", problem=problem)
        return min(found, key=lambda one: one.ends_at, default=None)
