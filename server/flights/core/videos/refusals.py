"""Why a video with a flight display is not made or given out. Knows nothing of HTTP."""

from server.kernel.refusal import Refusal


class FlightVideosBusy(Refusal):
    """One of this user is being made already, or too many wait."""

    def __init__(self, words: str) -> None:
        super().__init__(words)


class FlightVideoNotMade(Refusal):
    """Nobody has asked for it, it is not finished, or it was removed after its time."""

    def __init__(self) -> None:
        super().__init__("there is no such video with a flight display: ask for it, and wait until it is ready")
