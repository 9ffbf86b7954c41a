"""The server half of the log protocol: list, data, end, erase. One request at a time; silent while armed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from simulator.dialect import Message, mavlink
from simulator.failure_modes import Failure
from simulator.flight import Flight
from simulator.logbook import Log, Logbook
from simulator.notices import Severity

CHUNK = 90
CHUNKS_PER_TICK = 10

Peer = tuple[int, int]


@dataclass(slots=True)
class Listing:
    next: int
    last: int


@dataclass(slots=True)
class Download:
    peer: Peer
    number: int
    log: Log
    at: int
    end: int
    sent: int = 0


class LogServer:
    def __init__(self, flight: Flight, logbook: Logbook, send: Callable[[Message], None]) -> None:
        self._flight = flight
        self._logbook = logbook
        self._send = send
        self._listing: Listing | None = None
        self._download: Download | None = None

    def receive(self, message: Message, peer: Peer) -> None:
        name = message.get_type()
        if self._download is not None and self._download.peer != peer:
            self._flight.notify(Severity.INFO, "Log download in progress")
        elif name == "LOG_REQUEST_LIST":
            self._listing = Listing(max(message.start, 1), min(message.end, len(self._logbook.logs)))
            self._download = None
        elif name == "LOG_REQUEST_DATA":
            self._begin(message, peer)
        elif name == "LOG_REQUEST_END":
            self._listing = self._download = None
        elif name == "LOG_ERASE" and not self._flight.armed:
            self._listing = self._download = None
            self._logbook.clear()

    def tick(self) -> None:
        if self._flight.armed:
            return
        if self._listing is not None:
            self._send_next_entry(self._listing)
        for _ in range(CHUNKS_PER_TICK):
            if self._download is not None:
                self._send_next(self._download)

    def _send_next_entry(self, listing: Listing) -> None:
        """Sends one per tick. Without logs on board a single entry reports that."""
        logs = self._logbook.logs
        if not logs:
            self._listing = None
            self._send(mavlink.MAVLink_log_entry_message(0, 0, 0, 0, 0))
            return
        if listing.next <= listing.last:
            log, number = logs[listing.next - 1], listing.next
            entry = (number, len(logs), len(logs), log.begun_unix_s, len(log.data))
            self._send(mavlink.MAVLink_log_entry_message(*entry))
            listing.next += 1
        if listing.next > listing.last:
            self._listing = None

    def _begin(self, message: Message, peer: Peer) -> None:
        """A log that does not exist gets no answer; a range past the end gets an empty chunk."""
        self._listing = self._download = None
        if not 0 < message.id <= len(self._logbook.logs):
            return
        log = self._logbook.logs[message.id - 1]
        end = min(message.ofs + message.count, len(log.data))
        self._download = Download(peer, message.id, log, message.ofs, end)

    def _send_next(self, download: Download) -> None:
        count = max(min(CHUNK, download.end - download.at), 0)
        data = bytes(download.log.data[download.at : download.at + count])
        download.sent += 1
        if Failure.LOG_DATA_DROPPED not in self._flight.failures or download.sent % 7:
            padded = list(data.ljust(CHUNK, b"\0"))
            self._send(mavlink.MAVLink_log_data_message(download.number, download.at, count, padded))
        download.at += count
        if count < CHUNK or download.at >= download.end:
            self._download = None
