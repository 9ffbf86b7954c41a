"""Bodies of requests that msgspec reads: strict, fast, and only once it is known who sends them."""

from __future__ import annotations

from typing import TypeVar

from starlette.requests import Request

from server.live.missions.plan_body import decode_body

_Body = TypeVar("_Body")


async def read_body(request: Request, kind: type[_Body]) -> _Body:
    """Raises MalformedBody, BadPlan; HTTPException 413 for one that is too large."""
    return decode_body(await request.body(), kind)
