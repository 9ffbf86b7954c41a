"""Replaces a drone's bearer credential by a key, while its agent waits at sign-in."""

from __future__ import annotations

import asyncio
from typing import Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.audit.store.action import AuditAction
from server.audit.store.trail import Actor
from server.fleet.store.drones import exchange_credential
from server.fleet.store.roster import Roster
from server.kernel.clock import Clock
from server.storage.database import Database
from wire.credential import Credential

WITHIN_S: Final = 2.0
"""A slower database must not delay a drone's link: the exchange is made at the next sign-in."""
_AGENT: Final = Actor(None, "agent")
_log = structlog.get_logger(__name__)


class CredentialExchange:
    """One instance per tower."""

    def __init__(self, database: Database, roster: Roster, clock: Clock) -> None:
        self._database = database
        self._roster = roster
        self._clock = clock

    async def __call__(self, credential: Credential, public_key: bytes, address: str) -> bool | None:
        """True: done, and the live picture knows it. False: the credential is no longer valid. None: not possible now;
        it may have been done nevertheless, which the agent finds out by signing in with its key."""
        try:
            async with asyncio.timeout(WITHIN_S):
                async with self._database.writing() as session:
                    done = await exchange_credential(
                        session,
                        drone_id=credential.drone_id,
                        credential_hash=credential.hashed(),
                        public_key=public_key,
                        action=AuditAction(by=_AGENT, at=self._clock(), address=address),
                    )
                if done:
                    await self._roster.refresh()
        except (SQLAlchemyError, OSError, TimeoutError) as error:
            _log.warning("credential_not_exchanged", drone_id=credential.drone_id, error=type(error).__name__)
            return None
        return done
