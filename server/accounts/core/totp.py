"""Authenticator codes (RFC 6238) and recovery codes. A core: takes `now`; knows no database.

A code has six digits. It is valid for its 30 seconds and for the 30 before and after, once: the caller stores the
newest used step and refuses it and all before.
"""

from __future__ import annotations

import hashlib
import secrets
from datetime import datetime
from io import BytesIO
from typing import Final

import pyotp
import segno

STEP_S: Final = 30
STEPS_AROUND: Final = 1
"""The clocks of telephones are this far off."""
RECOVERY_CODES: Final = 10
_LETTERS: Final = "abcdefghjkmnpqrstuvwxyz23456789"
ISSUER: Final = "Control Tower"


def new_secret() -> str:
    """160 random bits in base32."""
    return pyotp.random_base32(32)


def provisioning_uri(secret: str, name: str) -> str:
    """What an authenticator reads from the picture."""
    return str(pyotp.TOTP(secret).provisioning_uri(name=name, issuer_name=ISSUER))


def qr_svg(uri: str) -> str:
    """A picture of `uri` for a page: an <svg> element without any script or style."""
    out = BytesIO()
    segno.make(uri, error="m").save(out, kind="svg", xmldecl=False, svgns=True, border=4, light="#fff", omitsize=True)
    return out.getvalue().decode()


def step_of(code: str, secret: str, *, now: datetime, after: int | None) -> int | None:
    """The time step that `code` belongs to, if it is one of now and newer than `after`; else None."""
    code = code.replace(" ", "")
    totp = pyotp.TOTP(secret)
    current = int(now.timestamp()) // STEP_S
    found = None
    for step in range(current - STEPS_AROUND, current + STEPS_AROUND + 1):
        # Compares all of them, so that the time reveals nothing.
        if secrets.compare_digest(totp.generate_otp(step).encode(), code.encode()) and (after is None or step > after):
            found = step
    return found


def new_recovery_codes() -> list[str]:
    """About 79 random bits each, so that a plain SHA-256 is hash enough."""
    return [
        "-".join("".join(secrets.choice(_LETTERS) for _ in range(4)) for _ in range(4)) for _ in range(RECOVERY_CODES)
    ]


def hash_recovery_code(code: str) -> str:
    """Blanks, hyphens and upper case do not count."""
    plain = "".join(letter for letter in code.lower() if letter.isalnum())
    return hashlib.sha256(plain.encode()).hexdigest()


def looks_like_totp(code: str) -> bool:
    plain = code.replace(" ", "")
    return len(plain) == 6 and plain.isascii() and plain.isdigit()
