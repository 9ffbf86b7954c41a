"""The video relay as recordings see it, with a stream that a test sends by hand."""

from collections.abc import Iterable

from server.video.core.situation import VideoCondition, VideoSituation
from server.video.core.streams import StreamKey, StreamSink
from server.video.store.capture import VideoStreams
from wire.ids import DroneId
from wire.video import Codec, decode_head

_HEADS_US = 1_000_000


class VideoByHand(VideoStreams):
    """Every drone has a camera with both codecs."""

    def __init__(self) -> None:
        self.sinks: dict[tuple[DroneId, StreamKey], StreamSink] = {}
        self.condition = VideoCondition.WAITING
        self.words = ""
        self.watched: set[StreamKey] = set()

    def attach(self, drone_id: DroneId, sink: StreamSink, now: float) -> bool:
        key = (drone_id, StreamKey(sink.quality, sink.codec))
        assert key not in self.sinks
        self.sinks[key] = sink
        return True

    def detach(self, drone_id: DroneId, sink: StreamSink) -> None:
        self.sinks.pop((drone_id, StreamKey(sink.quality, sink.codec)), None)

    def situation(self, drone_id: DroneId) -> VideoSituation:
        return VideoSituation(self.condition, self.words, (Codec.MPEG1, Codec.H264))

    def wanted(self, drone_id: DroneId) -> set[StreamKey]:
        return self.watched | {key for one, key in self.sinks if one == drone_id}

    def send(self, drone_id: int, messages: Iterable[bytes], *, late_us: int = 40_000) -> None:
        """Sends the messages to every recorder of this stream, each as if received `late_us` after its capture."""
        for message in messages:
            head = decode_head(message)
            sink = self.sinks.get((DroneId(drone_id), StreamKey(head.quality, head.codec)))
            if sink is not None:
                sink.unit(message, head, (head.capture_us + late_us) / _HEADS_US)
