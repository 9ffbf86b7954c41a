"""People: signing in and out, passwords, passkeys, second factors, tokens, preferences."""

from typing import Final

from server.accounts.api import (
    passkey_routes,
    preference_routes,
    proof_routes,
    second_factor_routes,
    session_routes,
    token_routes,
    user_routes,
)
from server.http.part import Part

PART: Final = Part(
    routers=(
        session_routes.router,
        proof_routes.router,
        preference_routes.router,
        second_factor_routes.router,
        passkey_routes.router,
        token_routes.router,
        user_routes.router,
    ),
    tags={
        "session": "Signing in and out.",
        "tokens": "API tokens: how a program signs in for a user.",
        "users": "Users administration, for admins.",
    },
)
