"""Whether sticks from the tower may reach the autopilot. No I/O.

After a hold the drone must not jump to the position of the new holder's sticks, so the gate blocks sticks until they
have been centred once. It blocks nothing else: a command always passes.
"""

from onboard_agent.autopilot.intent import Sticks


class StickGate:
    """Closed by a hold, opened by centred sticks or by a command to fly without them."""

    def __init__(self) -> None:
        self.open = True

    def close(self) -> None:
        """A hold has begun."""
        self.open = False

    def let_go(self) -> None:
        """Opens the gate, because the drone flies by command or is disarmed."""
        self.open = True

    def admit(self, sticks: Sticks) -> bool:
        """Whether these sticks may pass. Centred ones open the gate for all that follow."""
        if sticks.centred:
            self.open = True
        return self.open
