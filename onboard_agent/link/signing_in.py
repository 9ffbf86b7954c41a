"""The agent's side of one sign-in by key (wire.sign_in): signs its hello, and checks the tower's signature. No I/O."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey

from onboard_agent import VERSION
from wire.channel_binding import BadCertificate, end_point
from wire.control_messages import Hello, SignIn, SignInChallenge, Welcome
from wire.drone_key import DroneKey, fingerprint, is_signed
from wire.ids import LinkId
from wire.key_agreement import LinkKeys, agree, public_bytes
from wire.sign_in import NONCE_BYTES, SIGN_IN_PROTOCOL, MalformedTranscript, SignInPurpose, Transcript

RandomBytes = Callable[[int], bytes]
_MAX_TEXT_LENGTH: Final = 100


class NotOurTower(Exception):
    """The peer is not the tower that enrolled this drone. The message gives the reason for a person."""


class KeySignIn:
    """`tower`: the tower's name as the agent knows it. `tower_key`: key of the only tower that the agent obeys, or None
    before the first one. `certificate`: the TLS channel's in DER, or None without TLS. Raises NotOurTower."""

    def __init__(
        self,
        challenge: SignInChallenge,
        *,
        key: DroneKey,
        tower: str,
        tower_key: bytes | None,
        certificate: bytes | None,
        purpose: SignInPurpose,
        private_key: X25519PrivateKey,
        random_bytes: RandomBytes,
        resume: int | None = None,
    ) -> None:
        if tower_key is not None and tower_key != challenge.tower_key:
            raise NotOurTower(
                f"{tower} is not the tower that enrolled this drone: its key is {fingerprint(challenge.tower_key)}, "
                f"and should be {fingerprint(tower_key)}. If it was set up again, enrol the drone again"
            )
        binding = b""
        if challenge.bound:
            if certificate is None:
                raise NotOurTower(f"{tower} wants its TLS certificate signed, and there is no TLS")
            try:
                binding = end_point(certificate)
            except BadCertificate as error:
                raise NotOurTower(
                    f"{tower} shows a certificate that is none: {str(error)[:_MAX_TEXT_LENGTH]}"
                ) from None
        self._key = key
        self._private_key = private_key
        self._tower_public_key = challenge.public_key
        self.tower_key = challenge.tower_key
        """Key of the tower at the other end; proven by its welcome."""
        try:
            self._transcript = Transcript(
                purpose=purpose,
                drone_id=key.drone_id,
                tower=tower,
                drone_key=key.public,
                tower_key=challenge.tower_key,
                agent_nonce=random_bytes(NONCE_BYTES),
                tower_nonce=challenge.nonce,
                agent_public_key=public_bytes(private_key),
                tower_public_key=challenge.public_key,
                binding=binding,
                resume=resume,
            )
        except MalformedTranscript as error:
            raise NotOurTower(f"{tower} sent a challenge that is none: {error}") from None

    def hello(self, *, takes: tuple[str, ...] = (), process: int = 0) -> Hello:
        """Returns the signed hello."""
        said = self._transcript
        return Hello(
            agent_version=VERSION,
            public_key=said.agent_public_key,
            protocol=SIGN_IN_PROTOCOL,
            resume=said.resume,
            takes=takes,
            process=process,
            sign_in=SignIn(
                purpose=int(said.purpose),
                drone_id=said.drone_id,
                drone_key=said.drone_key,
                tower=said.tower,
                nonce=said.agent_nonce,
                binding=said.binding,
                signature=self._key.sign(said.for_agent()),
            ),
        )

    def welcomed(self, welcome: Welcome) -> LinkKeys:
        """Returns the keys of the link. Raises NotOurTower if the tower of the challenge has not signed the welcome,
        and BadPublicKey."""
        link_id = LinkId(welcome.link_id)
        if welcome.public_key != self._tower_public_key or not is_signed(
            self.tower_key, welcome.signature, self._transcript.for_tower(link_id)
        ):
            raise NotOurTower(f"{self._transcript.tower} cannot prove that it is the tower whose key it shows")
        return agree(self._private_key, welcome.public_key, salt=self._transcript.salt(), link_id=link_id)
