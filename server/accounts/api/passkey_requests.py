"""Reads from a request for whom a passkey challenge is: before sign-in the browser, identified by its own cookie,
afterwards the session. Also for which address of the tower."""

from __future__ import annotations

import hashlib
import re
import secrets
from dataclasses import dataclass
from typing import Annotated, Final

from fastapi import Depends, Request, Response

from server.accounts.core.challenges import LIFETIME_S, ChallengeOver, Challenges, Purpose
from server.accounts.core.relying_party import RelyingParty, relying_party
from server.accounts.store.passkey_sign_in import PasskeyCeremony
from server.http.dependencies import ClockDep, PasskeySignInDep, SettingsDep
from server.http.peer_address import address_of
from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.runtime.settings import Settings

BROWSER_COOKIE: Final = "tower_passkey"
"""Identifies the browser that asked for a challenge, not its user."""
_BROWSER: Final = re.compile(r"[A-Za-z0-9_-]{43}")


@dataclass(frozen=True)
class PasskeyRequest:
    """A request that asks for a passkey challenge, or answers one."""

    request: Request
    settings: Settings
    challenges: Challenges
    clock: Clock

    def begin_sign_in(self, response: Response) -> PasskeyCeremony:
        """Sets the browser's cookie, or keeps the one it has because another tab may be waiting for an answer.

        Raises PasskeysUnavailable.
        """
        party = self._relying_party()
        browser = self.request.cookies.get(BROWSER_COOKIE, "")
        if not _BROWSER.fullmatch(browser):
            browser = secrets.token_urlsafe(32)
        response.set_cookie(
            BROWSER_COOKIE,
            browser,
            max_age=int(LIFETIME_S),
            path="/api/v1/session",
            httponly=True,
            samesite="strict",
            secure=self.request.url.scheme == "https",
        )
        return PasskeyCeremony(Purpose.SIGN_IN, _asker(browser), party)

    def of_sign_in(self) -> PasskeyCeremony:
        """Returns the challenge that this browser must have been given. Raises PasskeysUnavailable, ChallengeOver."""
        browser = self.request.cookies.get(BROWSER_COOKIE, "")
        if not _BROWSER.fullmatch(browser):
            raise ChallengeOver
        return PasskeyCeremony(Purpose.SIGN_IN, _asker(browser), self._relying_party())

    def of_session(self, principal: Principal, purpose: Purpose) -> PasskeyCeremony:
        """Returns the ceremony of this session. Raises PasskeysUnavailable."""
        return PasskeyCeremony(purpose, f"session {principal.session_id}", self._relying_party())

    def challenge_for(self, ceremony: PasskeyCeremony) -> bytes:
        """Raises TooManyChallenges."""
        address, now_s = address_of(self.request), self.clock().timestamp()
        return self.challenges.give(purpose=ceremony.purpose, asker=ceremony.asker, address=address, now_s=now_s)

    def _relying_party(self) -> RelyingParty:
        _, port = self.request.scope.get("server") or ("", self.settings.port)
        host = self.request.headers.get("host", "")
        return relying_party(public_url=self.settings.public_url, host=host, port=int(port or 0))


async def _passkey_request(
    request: Request, settings: SettingsDep, passkey_sign_in: PasskeySignInDep, clock: ClockDep
) -> PasskeyRequest:
    return PasskeyRequest(request, settings, passkey_sign_in.challenges, clock)


PasskeyRequestDep = Annotated[PasskeyRequest, Depends(_passkey_request)]


def _asker(browser: str) -> str:
    return "browser " + hashlib.sha256(browser.encode()).hexdigest()
