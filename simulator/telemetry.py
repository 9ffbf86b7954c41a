"""How often each message is sent.

Unrequested, the vehicle sends only its flavour's messages (ArduPilot: heartbeats), texts, and an occasional TIMESYNC.
"""

from __future__ import annotations

from collections.abc import Mapping

from simulator.dialect import Message, mavlink
from simulator.flavour import Flavour
from simulator.flight import Flight
from simulator.flight_constants import TICK_S

INTERVAL_MAX_S = 2000.0
"""The maximum that MESSAGE_INTERVAL can report, in microseconds."""
TIMESYNC = 111
TIMESYNC_S = 10.0

STREAMS: dict[int, tuple[int, ...]] = {
    mavlink.MAV_DATA_STREAM_RAW_SENSORS: (27, 29),
    mavlink.MAV_DATA_STREAM_EXTENDED_STATUS: (1, 24, 42, 62, 87, 125, 152, 162),
    mavlink.MAV_DATA_STREAM_RC_CHANNELS: (36, 65),
    mavlink.MAV_DATA_STREAM_POSITION: (32, 33),
    mavlink.MAV_DATA_STREAM_EXTRA1: (30,),
    mavlink.MAV_DATA_STREAM_EXTRA2: (74,),
    mavlink.MAV_DATA_STREAM_EXTRA3: (2, 147, 168, 193, 241),
}


class Telemetry:
    def __init__(self, flavour: Flavour, *, pace: float = 1.0) -> None:
        """`pace`: simulated seconds in which a message comes that is due each second."""
        self._flavour = flavour
        self._pace = pace
        self._interval_s = dict(flavour.intervals_s)
        self._due_s = dict(flavour.intervals_s)
        self._timesync_due_s = TIMESYNC_S

    @property
    def intervals_s(self) -> Mapping[int, float]:
        """What is sent by itself now."""
        return self._interval_s

    def knows(self, message_id: int) -> bool:
        return message_id in self._flavour.reports

    def interval_us(self, message_id: int) -> int:
        """Returns -1 if the message is not being sent."""
        interval = self._interval_s.get(message_id)
        return -1 if interval is None else round(interval * 1e6)

    def set_interval(self, message_id: int, interval_us: float, now_s: float) -> bool:
        """0 restores the default, -1 switches off; False for an unknown message."""
        if message_id not in self._flavour.reports and message_id not in self._flavour.setup_reports:
            return False
        if message_id in self._flavour.fixed_rates:
            return True
        if interval_us == 0:
            interval_us = self._flavour.intervals_s.get(message_id, 0.0) * 1e6
        if interval_us <= 0:
            self._interval_s.pop(message_id, None)
            self._due_s.pop(message_id, None)
            return True
        interval_s = min(max(interval_us * 1e-6, TICK_S), INTERVAL_MAX_S)
        self._interval_s[message_id] = interval_s
        self._due_s[message_id] = now_s + TICK_S
        return True

    def set_stream(self, stream: int, rate_hz: float, now_s: float) -> None:
        """REQUEST_DATA_STREAM: 0 is all groups; a rate of 0 stops."""
        if not self._flavour.obeys_stream_requests:
            return
        groups = STREAMS.values() if stream == 0 else [STREAMS.get(stream, ())]
        for group in groups:
            for message_id in group:
                self.set_interval(message_id, 1e6 / rate_hz if rate_hz > 0 else -1, now_s)

    def report(self, message_id: int, flight: Flight) -> Message | None:
        builder = self._flavour.reports.get(message_id) or self._flavour.setup_reports.get(message_id)
        return builder(flight) if builder is not None else None

    def due(self, flight: Flight) -> list[Message]:
        messages = []
        now_s = flight.now_s + 1e-9
        for message_id, due_s in self._due_s.items():
            if now_s < due_s:
                continue
            interval_s = self._interval_s[message_id] * self._pace
            # Advances by a whole number of intervals, so that the average rate is exact and no backlog builds up.
            self._due_s[message_id] = due_s + interval_s * (1 + int((now_s - due_s) / interval_s))
            message = self.report(message_id, flight)
            if message is not None:
                messages.append(message)
        if now_s >= self._timesync_due_s:
            self._timesync_due_s += TIMESYNC_S
            messages.append(mavlink.MAVLink_timesync_message(0, round(flight.now_s * 1e9)))
        return messages
