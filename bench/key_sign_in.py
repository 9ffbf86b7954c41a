"""Signs in at a tower's control channel as an agent does, for programs that use the channel directly."""

from __future__ import annotations

import secrets

from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from websockets.asyncio.client import ClientConnection

from onboard_agent.link.signing_in import KeySignIn
from wire.control_messages import SignInChallenge, decode_to_agent, encode_message
from wire.drone_key import DroneKey
from wire.sign_in import SignInPurpose


async def key_sign_in(connection: ClientConnection, key: DroneKey, *, resume: int | None = None) -> KeySignIn:
    """Receives the challenge on a channel just opened with `tower-agent.v2`."""
    challenge = decode_to_agent(str(await connection.recv()))
    if not isinstance(challenge, SignInChallenge):
        raise RuntimeError(f"the tower began with {challenge}")
    return KeySignIn(
        challenge,
        key=key,
        tower="127.0.0.1",
        tower_key=None,
        certificate=None,
        purpose=SignInPurpose.LINK,
        private_key=X25519PrivateKey.generate(),
        random_bytes=secrets.token_bytes,
        resume=resume,
    )


async def say_hello(
    connection: ClientConnection,
    key: DroneKey,
    *,
    takes: tuple[str, ...] = (),
    process: int = 0,
    resume: int | None = None,
) -> KeySignIn:
    """Receives the challenge and answers it. The tower's answer is the next message."""
    sign_in = await key_sign_in(connection, key, resume=resume)
    await connection.send(encode_message(sign_in.hello(takes=takes, process=process)))
    return sign_in
