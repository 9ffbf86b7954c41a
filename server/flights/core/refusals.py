"""Why a flight is not given out. Knows nothing of HTTP."""

from server.kernel.refusal import Refusal


class UnknownFlight(Refusal):
    """Never was, deleted, or removed to make room; also a flight that this user may not know of."""

    def __init__(self) -> None:
        super().__init__("there is no such flight: it may have been removed to make room")


class FlightRunning(Refusal):
    def __init__(self) -> None:
        super().__init__("the flight is still being recorded: wait until the drone is disarmed")


class FlightElsewhere(Refusal):
    """Its files are in another folder."""

    def __init__(self) -> None:
        super().__init__("the files of this flight are not on this tower")


class BadPage(Refusal):
    """`before` is not what an earlier page had in `next`."""

    def __init__(self) -> None:
        super().__init__("`before` must be the `next` of an earlier page")


class NotIdentified(Refusal):
    """It took too much time or memory, or the file cannot be read."""

    def __init__(self, words: str) -> None:
        super().__init__(words)
