"""Tells browsers how recordings get on, and counts it."""

from __future__ import annotations

from collections import Counter
from typing import Literal

from server.live.hub import Hub
from server.live.live_messages import Recording
from server.video.core.recordings.views import RecordingView
from wire.ids import DroneId

What = Literal["begun", "ended", "ready", "failed", "removed"]


class RecordingNotifier:
    """`counts`: notifications by kind since the start of the tower."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self.counts: Counter[str] = Counter()

    def publish(self, event: What, view: RecordingView) -> None:
        """Notifies all who may watch the drone's video now."""
        self.counts[event] += 1
        if event in ("begun", "ended"):
            about = {"recording": view.id, "event": event, "quality": view.quality}
            self._hub.flights.note(DroneId(view.drone_id), "video", about)
        state = self._hub.state
        drone = state.drones.get(DroneId(view.drone_id))
        if drone is not None:
            state.notify_video_watchers(drone, Recording(view.drone_id, event, view), of=view.began_at)
