"""What a capability gives to the tower: `part.py` of its folder has it as `PART`, where `server/app/routers.py` finds it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fastapi import APIRouter


@dataclass(frozen=True, kw_only=True)
class Part:
    routers: tuple[APIRouter, ...]
    tags: Mapping[str, str] = field(default_factory=dict)
    """Groups of routes in the OpenAPI document, and what each is about."""
