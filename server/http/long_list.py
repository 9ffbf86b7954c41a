"""A list of any length as JSON, made a few entries at a time. Between two slices the event loop passes frames on."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from itertools import islice
from typing import Final

from fastapi import Response
from pydantic import BaseModel

AT_ONCE: Final = 50
"""A millisecond or two."""


async def long_list(views: Iterable[BaseModel], *, at_once: int = AT_ONCE) -> Response:
    """For a route that says its `response_model`. `views`: a generator, so that they are made in slices too."""
    parts: list[str] = []
    left = iter(views)
    while some := list(islice(left, at_once)):
        parts += [one.model_dump_json(by_alias=True) for one in some]
        await asyncio.sleep(0)
    return Response("[" + ",".join(parts) + "]", media_type="application/json")
