"""For whom a challenge is, read from a request: before somebody is signed in the browser, which a cookie of its own
names, afterwards the session. And for which address of the tower."""

from __future__ import annotations

import hashlib
import re
import secrets
from typing import Final

from fastapi import Request, Response

from server.api.tower import address_of, tower_of
from server.domain.people import Principal
from server.live.accounts.challenges import LIFETIME_S, ChallengeOver, Purpose
from server.live.accounts.relying_party import RelyingParty, relying_party
from server.store.accounts.passkey_sign_in import Asked

BROWSER_COOKIE: Final = "tower_passkey"
"""Which browser asked for a challenge. It says nothing about who sits there."""
_BROWSER: Final = re.compile(r"[A-Za-z0-9_-]{43}")


def party_of(request: Request) -> RelyingParty:
    """Raises PasskeysUnavailable."""
    settings = tower_of(request).settings
    _, port = request.scope.get("server") or ("", settings.port)
    return relying_party(public_url=settings.public_url, host=request.headers.get("host", ""), port=int(port or 0))


def ask_at_the_door(request: Request, response: Response) -> Asked:
    """Gives the browser its cookie, or leaves it the one that it has: another tab may be waiting for an answer.

    Raises PasskeysUnavailable.
    """
    party = party_of(request)
    browser = request.cookies.get(BROWSER_COOKIE, "")
    if not _BROWSER.fullmatch(browser):
        browser = secrets.token_urlsafe(32)
    response.set_cookie(
        BROWSER_COOKIE,
        browser,
        max_age=int(LIFETIME_S),
        path="/api/v1/session",
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )
    return Asked(Purpose.SIGN_IN, _asker(browser), party)


def asked_at_the_door(request: Request) -> Asked:
    """What must have been asked of this browser before it signs in. Raises PasskeysUnavailable or ChallengeOver."""
    browser = request.cookies.get(BROWSER_COOKIE, "")
    if not _BROWSER.fullmatch(browser):
        raise ChallengeOver
    return Asked(Purpose.SIGN_IN, _asker(browser), party_of(request))


def asked_of(request: Request, principal: Principal, purpose: Purpose) -> Asked:
    """What is or was asked of this session. Raises PasskeysUnavailable."""
    return Asked(purpose, f"session {principal.session_id}", party_of(request))


def challenge_for(request: Request, asked: Asked) -> bytes:
    """Raises TooManyChallenges."""
    tower = tower_of(request)
    return tower.passkey_sign_in.challenges.give(
        purpose=asked.purpose, asker=asked.asker, address=address_of(request), now_s=tower.clock().timestamp()
    )


def _asker(browser: str) -> str:
    return "browser " + hashlib.sha256(browser.encode()).hexdigest()
