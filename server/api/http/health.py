"""`/api/v1/health` and `/api/v1/health/ready`: for whatever watches over the tower. Tell nothing about anybody."""

from __future__ import annotations

import asyncio
import time
from typing import Final

from fastapi import APIRouter, Request
from pydantic import BaseModel

from server.api.http.problem_docs import database_answers
from server.api.tower import tower_of
from server.store.database_facts import test_write

router = APIRouter(prefix="/api/v1", tags=["health"])

TESTED_FOR_S: Final = 1.0
"""Whoever asks more often gets the last answer: strangers may ask, and a write is not free."""


class Health(BaseModel):
    status: str
    version: str


@router.get("/health")
async def health(request: Request) -> Health:
    """Answers while the tower runs, whatever the database does: a restart would not mend that. A tower that waits for
    another one's end says `standby`."""
    return Health(status="ok", version=request.app.version)


@router.get("/health/ready", operation_id="ready", responses=database_answers())
async def ready(request: Request) -> Health:
    """Whether the tower can do everything: it has the lock, and the database takes writes. 503 in words where not."""
    await request.app.state.readiness.test()
    return Health(status="ok", version=request.app.version)
