"""Request bodies that msgspec decodes: strict, fast, and only after authentication."""

from __future__ import annotations

from typing import TypeVar

from starlette.requests import Request

from server.plans.core.plan_body import decode_body

_Body = TypeVar("_Body")


async def read_body(request: Request, kind: type[_Body]) -> _Body:
    """Raises MalformedBody, BadPlan; HTTPException 413 for a body that is too large."""
    return decode_body(await request.body(), kind)
