"""A list of any length as JSON, made a few entries at a time. Between two slices the event loop passes frames on.

Rows of a database are given as an asynchronous generator over `storage.in_slices.slices`, so that each is gone once it
is written: 15,000 that end together keep the loop for 30 ms."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterable, AsyncIterator, Iterable
from typing import Final

from fastapi import Response
from pydantic import BaseModel

AT_ONCE: Final = 50
"""A millisecond or two."""


async def long_list(views: Iterable[BaseModel] | AsyncIterable[BaseModel], *, at_once: int = AT_ONCE) -> Response:
    """For a route that says its `response_model`. `views`: a generator, so that they are made in slices too."""
    parts: list[str] = []
    async for one in _one_by_one(views):
        parts.append(one.model_dump_json(by_alias=True))
        if len(parts) % at_once == 0:
            await asyncio.sleep(0)
    return Response("[" + ",".join(parts) + "]", media_type="application/json")


async def _one_by_one(views: Iterable[BaseModel] | AsyncIterable[BaseModel]) -> AsyncIterator[BaseModel]:
    if isinstance(views, AsyncIterable):
        async for one in views:
            yield one
    else:
        for one in views:
            yield one
