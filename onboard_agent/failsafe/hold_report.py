"""The steps of holds as reported to the tower: numbered, each with its order. No I/O."""

from wire.control_messages import HoldCause, HoldProgress, HoldStep


class HoldReport:
    """Call `begin` for each hold and `add` for each step that was done; `pop` returns them.

    `steps_reported`: where the numbers start; each process needs a different start (HoldProgress).
    """

    def __init__(self, steps_reported: int) -> None:
        self.cause = HoldCause.ORDER
        self._order_id = 0
        self._epoch = 0
        self._began_at = 0.0
        self._steps_reported = steps_reported
        self._progress: list[HoldProgress] = []

    def begin(self, *, cause: HoldCause, order_id: int, epoch: int, now: float) -> None:
        """The steps that follow belong to this hold."""
        self.cause = cause
        self._order_id, self._epoch, self._began_at = order_id, epoch, now

    def add(self, step: HoldStep, detail: str, now: float) -> None:
        """Adds a step that was done."""
        self._steps_reported += 1
        self._progress.append(
            HoldProgress(
                number=self._steps_reported,
                order_id=self._order_id,
                epoch=self._epoch,
                step=step,
                detail=detail,
                elapsed_ms=round((now - self._began_at) * 1000.0, 1),
                cause=self.cause,
            )
        )

    def pop(self) -> list[HoldProgress]:
        """The steps done since the last call, in order."""
        progress, self._progress = self._progress, []
        return progress
