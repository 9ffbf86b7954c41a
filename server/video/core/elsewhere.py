"""The video of a drone that another tower has, as that tower tells of it. Pure."""

from typing import Final

from server.video.core.situation import NO_PICTURES_AFTER_S, VideoCondition, VideoSituation
from server.video.core.streams import StreamKey
from wire.ids import UserId
from wire.video import Codec

OUT_OF_REACH: Final = "The tower that has {name} is not within reach."
OLDER_TOWER: Final = "The tower that has {name} is of an older version, and its video is seen there only."


class VideoElsewhere:
    """`trouble`: why nothing can come from there, with the name's place; empty if nothing is known against it."""

    def __init__(self, trouble: str = "") -> None:
        self.trouble = trouble
        self.barred: UserId | None = None
        """Who may not watch, though it is their drone: an admin has taken the video with the controls."""
        self._told: dict[StreamKey, VideoSituation] = {}

    def tell(self, told: dict[StreamKey, VideoSituation], barred: UserId | None) -> None:
        """What that tower says now of the streams that it is asked for."""
        self._told, self.barred, self.trouble = told, barred, ""

    @property
    def codecs(self) -> tuple[Codec, ...]:
        """Those that can be requested; empty: not known yet."""
        return next((one.codecs for one in self._told.values() if one.codecs), ())

    def situation(self, name: str, key: StreamKey, *, live: bool, asked_for_s: float) -> VideoSituation:
        """As the viewers of this tower are told. `live`: pictures arrive here."""
        if self.trouble:
            condition = VideoCondition.NO_AGENT_VIDEO if self.trouble == OLDER_TOWER else VideoCondition.OFFLINE
            return VideoSituation(condition, self.trouble.format(name=name))
        told = self._told.get(key)
        if told is not None and (live or told.condition is not VideoCondition.LIVE):
            return told
        codecs = told.codecs if told is not None else ()
        if told is not None and asked_for_s > NO_PICTURES_AFTER_S:
            words = f"No pictures come from the tower that has {name}."
            return VideoSituation(VideoCondition.NO_AGENT_VIDEO, words, codecs)
        return VideoSituation(VideoCondition.WAITING, f"Waiting for the first picture of {name}.", codecs)
