"""Why an alert is not acknowledged. Knows nothing of HTTP."""

from server.kernel.refusal import Refusal


class UnknownAlert(Refusal):
    """Never was, is over and needs nobody, or is about a drone that this user may not see."""

    def __init__(self) -> None:
        super().__init__("there is no such alert: it may be over")


class MayNotAcknowledge(Refusal):
    """An observer of the drone's team."""

    def __init__(self, name: str) -> None:
        super().__init__(f"you may watch {name}, but not acknowledge its alerts: its pilots do")
