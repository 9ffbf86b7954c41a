"""Whether sticks from the tower may reach the autopilot. No I/O.

After a hold the machine must not jump to wherever the new holder's sticks happen to be, so they are kept back until
they have been centred once. Nothing else is kept back: a command always passes.
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
        """There is nothing to protect any more: the drone flies by command, or is disarmed."""
        self.open = True

    def admit(self, sticks: Sticks) -> bool:
        """Whether these sticks may pass. Centred ones open the gate for all that follow."""
        if sticks.centred:
            self.open = True
        return self.open
