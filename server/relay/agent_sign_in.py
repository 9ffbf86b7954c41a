"""How an agent signs in, on whatever it opens: the drone's credential, over TLS or from this very machine."""

import hmac

from starlette.requests import HTTPConnection

from server.private_path import is_private_path
from server.relay.hub import Hub
from wire.credential import Credential, MalformedCredential, parse_credential


class AgentRefused(Exception):
    """Sign-in of an agent failed. Carries the HTTP status and words for whoever reads the agent's log."""

    def __init__(self, status: int, words: str) -> None:
        super().__init__(words)
        self.status = status
        self.words = words


def sign_in(hub: Hub, connection: HTTPConnection) -> Credential:
    """The credential of the request, checked. Raises AgentRefused; never says which part was wrong."""
    if not is_private_path(connection):
        raise AgentRefused(403, "agents must use https: a credential must not cross the network in the clear")
    scheme, _, text = connection.headers.get("authorization", "").partition(" ")
    if scheme.lower() != "bearer":
        raise AgentRefused(401, "an agent signs in with 'Authorization: Bearer <credential>'")
    try:
        credential = parse_credential(text)
    except MalformedCredential as error:
        raise AgentRefused(401, str(error)) from None
    drone = hub.drone(credential.drone_id)
    if drone is None or not hmac.compare_digest(drone.record.credential_hash, credential.hashed()):
        raise AgentRefused(401, "this credential is not known")
    return credential
