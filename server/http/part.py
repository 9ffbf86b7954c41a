"""What a capability gives to the tower: `PART` in `part.py` of its folder. `server/app/routers.py` finds the parts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass, field
from typing import TypeVar, cast

from fastapi import APIRouter

from server.kernel.clock import Clock
from server.live.hub import Hub
from server.runtime.settings import Settings
from server.runtime.side_thread import SideThread
from server.runtime.vault import Vault
from server.storage.database import Database

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Common:
    """What the services of every capability are made from."""

    settings: Settings
    clock: Clock
    database: Database
    hub: Hub
    vault: Vault
    side_thread: SideThread


class Services:
    """The services of the parts, each by its type. A route takes one with `provided` (`dependencies.py`)."""

    def __init__(self, services: Iterable[object]) -> None:
        self._by_type = {type(one): one for one in services}

    def of(self, kind: type[T]) -> T:
        """Returns the service of this type. KeyError: no part makes one."""
        return cast("T", self._by_type[kind])


def _no_services(_common: Common) -> Iterable[object]:
    return ()


@dataclass(frozen=True, kw_only=True)
class Part:
    routers: tuple[APIRouter, ...]
    tags: Mapping[str, str] = field(default_factory=dict)
    """Groups of routes in the OpenAPI document, and what each is about."""
    services: Callable[[Common], Iterable[object]] = _no_services
    """Makes the services of one tower. Nothing is opened yet."""
    running: Callable[[Common, Services], AbstractAsyncContextManager[None]] | None = None
    """Entered when the hub knows its drones, before the first agent is answered; left when the tower stops."""
