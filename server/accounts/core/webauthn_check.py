"""Options for the browser and the check of its response, by py_webauthn. No database, no HTTP, no clock.

Requires a discoverable credential (it needs no name), user verification, and no attestation: the tower does not ask who
made an authenticator. The caller (`passkeys.py`) compares the counter.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from webauthn import (
    generate_authentication_options,
    generate_registration_options,
    verify_authentication_response,
    verify_registration_response,
)
from webauthn.helpers import (
    options_to_json_dict,
    parse_attestation_object,
    parse_registration_credential_json,
)
from webauthn.helpers.cose import COSEAlgorithmIdentifier
from webauthn.helpers.structs import (
    AttestationConveyancePreference,
    AttestationFormat,
    AuthenticatorSelectionCriteria,
    AuthenticatorTransport,
    PublicKeyCredentialDescriptor,
    ResidentKeyRequirement,
    UserVerificationRequirement,
)

from server.accounts.core.challenges import LIFETIME_S
from server.accounts.core.relying_party import RelyingParty
from server.accounts.core.webauthn_values import Assertion, KnownCredential, NewCredential, PasskeyFault

TOWER_NAME: Final = "Control Tower"
MAX_CREDENTIAL_ID_BYTES: Final = 1023
"""WebAuthn's own bound."""
MAX_PUBLIC_KEY_BYTES: Final = 1024
"""RSA of 4096 bits needs 540: checking a signature must not become work."""
_ALGORITHMS: Final = [
    COSEAlgorithmIdentifier.EDDSA,
    COSEAlgorithmIdentifier.ECDSA_SHA_256,
    COSEAlgorithmIdentifier.RSASSA_PKCS1_v1_5_SHA_256,
]
_TIMEOUT_MS: Final = int(LIFETIME_S * 1000)


def creation_options(
    party: RelyingParty, *, challenge: bytes, user_handle: bytes, name: str, there: Sequence[KnownCredential]
) -> dict[str, Any]:
    """For `navigator.credentials.create()`, as JSON. `there`: an authenticator with one of them makes no second."""
    options = generate_registration_options(
        rp_id=party.id,
        rp_name=TOWER_NAME,
        user_id=user_handle,
        user_name=name,
        challenge=challenge,
        timeout=_TIMEOUT_MS,
        attestation=AttestationConveyancePreference.NONE,
        authenticator_selection=AuthenticatorSelectionCriteria(
            resident_key=ResidentKeyRequirement.REQUIRED,
            user_verification=UserVerificationRequirement.REQUIRED,
        ),
        exclude_credentials=_descriptors(there),
        supported_pub_key_algs=_ALGORITHMS,
    )
    return options_to_json_dict(options)


def request_options(
    party: RelyingParty, *, challenge: bytes, allowed: Sequence[KnownCredential] = ()
) -> dict[str, Any]:
    """For `navigator.credentials.get()`, as JSON. Without `allowed`: whatever the person has for this tower."""
    options = generate_authentication_options(
        rp_id=party.id,
        challenge=challenge,
        timeout=_TIMEOUT_MS,
        allow_credentials=_descriptors(allowed),
        user_verification=UserVerificationRequirement.REQUIRED,
    )
    return options_to_json_dict(options)


def check_new(credential: dict[str, Any], *, challenge: bytes, party: RelyingParty) -> NewCredential:
    """Raises PasskeyFault."""
    try:
        parsed = parse_registration_credential_json(credential)
        attestation = parse_attestation_object(parsed.response.attestation_object)
        by_itself = attestation.fmt == AttestationFormat.PACKED and not attestation.att_stmt.x5c
        if attestation.fmt != AttestationFormat.NONE and not by_itself:
            # None was requested; some authenticators sign with the new key all the same.
            raise PasskeyFault("attestation that nobody asked for")
        found = verify_registration_response(
            credential=parsed,
            expected_challenge=challenge,
            expected_rp_id=party.id,
            expected_origin=party.origin,
            require_user_verification=True,
            supported_pub_key_algs=_ALGORITHMS,
        )
    except PasskeyFault:
        raise
    except Exception as error:  # the library lets KeyError and the like through for odd CBOR
        raise PasskeyFault(_why(error)) from None
    if not 0 < len(found.credential_id) <= MAX_CREDENTIAL_ID_BYTES or found.credential_id != parsed.raw_id:
        raise PasskeyFault("the credential's id is not its own")
    if len(found.credential_public_key) > MAX_PUBLIC_KEY_BYTES:
        raise PasskeyFault("the public key is too large")
    transports = tuple(sorted(one.value for one in parsed.response.transports or ()))
    return NewCredential(
        found.credential_id, found.credential_public_key, found.sign_count, transports, found.credential_backed_up
    )


def check_assertion(
    credential: dict[str, Any], *, challenge: bytes, party: RelyingParty, public_key: bytes
) -> Assertion:
    """Raises PasskeyFault. The counter is not looked at."""
    try:
        found = verify_authentication_response(
            credential=credential,
            expected_challenge=challenge,
            expected_rp_id=party.id,
            expected_origin=party.origin,
            credential_public_key=public_key,
            credential_current_sign_count=0,
            require_user_verification=True,
        )
    except Exception as error:
        raise PasskeyFault(_why(error)) from None
    return Assertion(found.new_sign_count, found.credential_backed_up)


def _descriptors(known: Sequence[KnownCredential]) -> list[PublicKeyCredentialDescriptor]:
    return [
        PublicKeyCredentialDescriptor(id=one.id, transports=[AuthenticatorTransport(way) for way in one.transports])
        for one in known
    ]


_WHY: Final = (
    ("origin", "wrong origin"),
    ("RP ID", "made for another site"),
    ("challenge", "wrong challenge"),
    ("verification is required", "the person was not verified"),
    ("not present", "nobody was present"),
    ("signature", "wrong signature"),
)


def _why(error: Exception) -> str:
    """Words of ours: those of the library repeat what was sent."""
    return next((ours for theirs, ours in _WHY if theirs in str(error)), "malformed")
