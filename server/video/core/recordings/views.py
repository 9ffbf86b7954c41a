"""How a recording looks from outside, over REST and on `/live` alike."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

State = Literal["recording", "finishing", "ready", "failed"]


class RecordedByView(BaseModel):
    """Who started it; `id` null if the account was deleted."""

    model_config = ConfigDict(frozen=True)

    id: int | None
    name: str


class RecordingView(BaseModel):
    """One recording of a drone's video."""

    model_config = ConfigDict(frozen=True)

    id: int
    drone_id: int
    by: RecordedByView
    state: Annotated[State, Field(description="`ready`: the file can be downloaded")]
    words: Annotated[str, Field(description="Why it ended by itself or failed; for people")]
    quality: Literal["low", "medium", "high"]
    codec: Annotated[Literal["mpeg1", "h264"], Field(description="As received; the file is always H.264")]
    began_at: Annotated[datetime, Field(description="When it was asked for")]
    first_picture_at: Annotated[
        datetime | None,
        Field(description="When the first picture of the file was taken; null: none came yet, or an old recording"),
    ]
    ended_at: datetime | None
    flights: Annotated[
        list[datetime], Field(description="Start times of the recorded flights, as the drone's `airborne_since`")
    ]
    size_bytes: int
    duration_s: Annotated[float | None, Field(description="Of the file")]
    pictures: int
    width: int | None
    height: int | None
