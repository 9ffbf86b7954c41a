"""What a flight needs of the controller's process. The shell is `onboard_agent.autonomy.child`."""

from collections.abc import Sequence
from typing import Protocol

from onboard_agent.autonomy.core.lines import Report, Seen, SetUp


class ControllerPort(Protocol):
    """One process at a time."""

    def start(self, set_up: SetUp) -> None:
        """Starts a process for this controller. An earlier one is ended."""

    def say(self, seen: Seen) -> None:
        """Passes telemetry on, without waiting."""

    def reports(self) -> Sequence[tuple[float, Report]]:
        """Returns what the process has said since the last call, in order, each with its time on the clock of `now`.
        Gone is the last of a process."""

    def waited_s(self) -> float:
        """Returns how long the process has waited for a processor since its start, in seconds; 0 if that cannot be
        told."""

    def stop(self) -> None:
        """Ends the process. Nothing of it is reported any more."""
