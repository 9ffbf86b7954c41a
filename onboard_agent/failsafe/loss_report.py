"""Reports the parameters that decide what happens on a loss: when all are read, and on each change. No I/O."""

from onboard_agent.autopilot.parameters import Parameters
from wire.autopilots import registry
from wire.control_messages import LossParameters


class LossReport:
    """Call `changed` while there is a link."""

    def __init__(self) -> None:
        self._sent: LossParameters | None = None

    def changed(self, parameters: Parameters, *, autopilot_kind: int, has_radio: bool | None) -> LossParameters | None:
        """Returns the report for the tower if it changed; None while the parameters are being read."""
        if not parameters.all_read:
            return None
        family = registry.FAMILIES.get(autopilot_kind)
        report = LossParameters(
            autopilot="" if family is None else family.name,
            values=parameters.loss_values,
            complete=parameters.complete,
            has_radio=has_radio,
        )
        if report == self._sent:
            return None
        self._sent = report
        return report

    def resend(self) -> None:
        """Reports everything again on a new tower link."""
        self._sent = None
