"""Metadata of a vehicle's own parameters as a response body. Pure and slow: call it in a thread."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

from server.kernel.refusal import Refusal
from wire.parameter_metadata import encode_metadata, read_metadata, unpack_text


class NoMetadata(Refusal):
    """`why`: a sentence."""

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"{name} says nothing of its own parameters. {why}")


class MetadataChoiceView(BaseModel):
    value: float
    description: str


class MetadataBitView(BaseModel):
    index: Annotated[int, Field(description="0: the lowest bit")]
    description: str


class MetadataEntryView(BaseModel):
    """One parameter. Omitted members are not known."""

    name: Annotated[str, Field(description="`{n}` stands for a number: the entry describes several parameters")]
    type: Annotated[str, Field(description="Uint8 ... Int32, Float")] = ""
    shortDesc: str = ""
    longDesc: str = ""
    units: str = ""
    default: float | None = None
    decimalPlaces: int | None = None
    min: float | None = None
    max: float | None = None
    increment: float | None = None
    rebootRequired: bool = False
    group: str = ""
    category: str = ""
    volatile: bool = False
    readOnly: bool = False
    values: list[MetadataChoiceView] = []
    bitmask: list[MetadataBitView] = []


class MetadataView(BaseModel):
    """In the format of MAVLink's COMP_METADATA_TYPE_PARAMETER, reduced by the agent to these members."""

    version: int
    parameters: list[MetadataEntryView]


def metadata_json(packed: bytes) -> bytes:
    """The `MetadataView`. Raises ValueError where the bytes are none."""
    return encode_metadata(read_metadata(unpack_text(packed)))
