"""What has become of the newest direction, as the controller is told. Pure."""

from onboard_agent.autonomy.core.lines import DirectionState


class Acknowledgement:
    """`number`: of the newest judged direction. `bounded`: it was reduced to the limits."""

    def __init__(self) -> None:
        self.number = 0
        self.state = DirectionState.DONE
        self.words = ""
        self.bounded = False

    def came(self, number: int) -> None:
        """A new direction is being judged."""
        self.number, self.bounded = number, False

    def judged(self, state: DirectionState, words: str = "", *, bounded: bool = False) -> None:
        """Sets the state of the newest direction."""
        self.state, self.words, self.bounded = state, words, bounded

    def ended(self, state: DirectionState, words: str = "") -> None:
        """A direction that was being flown is done or has expired. Others keep their state."""
        if self.state is DirectionState.FLYING:
            self.state, self.words = state, words

    def told(self) -> tuple[int, DirectionState, str, bool]:
        """Returns the last fields of `lines.Seen`."""
        return self.number, self.state, self.words, self.bounded
