"""How the making of a video with a flight display looks from outside."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field


class DisplayVideoView(BaseModel):
    """A video with a burnt-in flight display, or how far its making is."""

    model_config = ConfigDict(frozen=True)

    flight_id: int
    recording_id: int
    state: Annotated[Literal["waiting", "making", "ready", "failed"], Field(description="`ready`: it has a file")]
    done: Annotated[float, Field(description="Part of the pictures that is done, 0 to 1")]
    words: Annotated[str, Field(description="Why it failed")]
    size_bytes: int
