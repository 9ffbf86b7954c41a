"""What a recording asks of the relay of video, and how the hub answers it."""

from __future__ import annotations

import time
from collections.abc import Collection
from typing import Protocol

from server.live.hub import Hub
from server.live.video.situation import VideoCondition, VideoSituation
from server.live.video.streams import StreamKey, StreamSink
from wire.ids import DroneId
from wire.video import Codec, Quality


class VideoStreams(Protocol):
    """Every method is plain and returns at once. `now`: monotonic seconds."""

    def attach(self, drone_id: DroneId, sink: StreamSink, now: float) -> bool:
        """From here on the sink gets the units of its stream, from a key picture on; the drone is asked for them. False
        if there is no such drone."""

    def detach(self, drone_id: DroneId, sink: StreamSink) -> None:
        """It gets no more. Harmless if it was detached already."""

    def situation(self, drone_id: DroneId) -> VideoSituation:
        """How it is with the drone's video now."""

    def wanted(self, drone_id: DroneId) -> Collection[StreamKey]:
        """Which of its streams somebody watches or records."""


class HubVideo(VideoStreams):
    """The video of a running tower."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub

    def attach(self, drone_id: DroneId, sink: StreamSink, now: float) -> bool:
        return self._hub.video.attach(drone_id, sink, now)

    def detach(self, drone_id: DroneId, sink: StreamSink) -> None:
        self._hub.video.detach(drone_id, sink)

    def situation(self, drone_id: DroneId) -> VideoSituation:
        drone, now = self._hub.drone(drone_id), time.monotonic()
        if drone is None:
            return VideoSituation(VideoCondition.OFFLINE)
        best = max(self.wanted(drone_id), default=StreamKey(Quality.MEDIUM, Codec.MPEG1))
        return self._hub.video.video_of(drone, now).situation(best, now)

    def wanted(self, drone_id: DroneId) -> Collection[StreamKey]:
        drone = self._hub.drone(drone_id)
        if drone is None:
            return ()
        video = self._hub.video.video_of(drone, time.monotonic())
        return {key for key, flow in video.flows.items() if flow.taken}
