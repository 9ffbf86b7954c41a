"""How many live connections one user, and one network address, may have open at the same time. Pure."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Protocol

from server.kernel.people import Principal
from wire.ids import UserId

TOO_MANY_SOCKETS: Final = 4430


class Connected(Protocol):
    """A connection, live or of video: whose it is, and from where."""

    @property
    def viewer(self) -> Principal:
        """Who signed in."""

    @property
    def address(self) -> str:
        """The network address of the other side."""


@dataclass(frozen=True)
class SocketBounds:
    """An office, or a club on its field, is behind one address; a person has a few tabs and programs."""

    per_user: int = 20
    per_address: int = 200

    def refusal(self, open_ones: Iterable[Connected], user_id: UserId, address: str) -> str | None:
        """Why one more connection may not be opened beside those that are; None if it may."""
        of_user = of_address = 0
        for one in open_ones:
            of_user += one.viewer.user_id == user_id
            of_address += one.address == address
        if of_user >= self.per_user:
            return f"this user has {of_user} connections already: close some first"
        if of_address >= self.per_address:
            return f"there are {of_address} connections from this address already"
        return None
