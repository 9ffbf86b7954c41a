"""What the hub knows of a drone's check before flight. Pure."""

from dataclasses import dataclass

from wire.ids import UserId


@dataclass(frozen=True)
class LossCheckMark:
    """What the check before flight came to, as far as the hub must know."""

    dangerous: bool = False
    """A loss would drop or lose the drone."""
    read_by: frozenset[UserId] = frozenset()
    """Users who have acknowledged exactly these dangers."""
    version: str = ""
    """Changes whenever the answer does."""

    def bars(self, user_id: UserId) -> bool:
        """Whether this user must read it before arming."""
        return self.dangerous and user_id not in self.read_by
