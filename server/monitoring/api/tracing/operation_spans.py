"""Spans of operations: each from its beginning to its end, and in it each order to the agent until the answer.

POST /api/v1/drones/{drone_id}/commands     the request
  operation command                         until people are told how it ended
    order command                           to the agent, by it to the autopilot, and back
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from opentelemetry.trace import Span, SpanKind, Status, StatusCode, set_span_in_context
from opentelemetry.util.types import AttributeValue

from server.monitoring.api.tracing.tracing import Tracing
from server.operations.core.operation import Operation, State
from wire.transactions import Outcome, TransactionResult

MAX_OPEN: Final = 1_000
"""Operations at a time. Those beyond have no spans."""


@dataclass
class _Open:
    operation: Span
    order: Span | None = None


class OperationSpans:
    """The operations service calls it, in the hub's own time: it only notes."""

    def __init__(self, tracing: Tracing) -> None:
        self._tracing = tracing
        self._open: dict[int, _Open] = {}

    def ordered(self, operation: Operation) -> None:
        """The next step was sent to the agent. The first one begins the operation, within the request's span."""
        if operation.by is None:
            return
        tracer = self._tracing.tracer
        there = self._open.get(operation.id)
        if there is None:
            if len(self._open) >= MAX_OPEN:
                return
            span = tracer.start_span(f"operation {operation.order.work}", attributes=_about(operation))
            there = self._open[operation.id] = _Open(span)
        _end(there.order)
        there.order = tracer.start_span(
            f"order {operation.order.work}",
            context=set_span_in_context(there.operation),
            kind=SpanKind.CLIENT,
            attributes={
                "tower.transaction": operation.transaction_id,
                "tower.step": operation.next_step,
                "tower.phase": operation.step.phase,
            },
        )

    def answered(self, operation: Operation, result: TransactionResult) -> None:
        """The agent has answered the order."""
        there = self._open.get(operation.id)
        if there is None or there.order is None:
            return
        there.order.set_attribute("tower.outcome", result.outcome.value)
        if result.code:
            there.order.set_attribute("mavlink.result", result.code)
        if result.outcome is not Outcome.DONE:
            there.order.set_status(Status(StatusCode.ERROR))
        _end(there.order)
        there.order = None

    def ended(self, operation: Operation) -> None:
        """Also an operation whose agent has not answered. One that ends again, later, is not known any more."""
        there = self._open.pop(operation.id, None)
        if there is None:
            return
        if there.order is not None:
            there.order.set_status(Status(StatusCode.ERROR, "no answer"))
            _end(there.order)
        there.operation.set_attribute("tower.state", operation.state.value)
        if operation.state is not State.DONE:
            there.operation.set_status(Status(StatusCode.ERROR))
        there.operation.end()


def _about(operation: Operation) -> dict[str, AttributeValue]:
    about: dict[str, AttributeValue] = {
        "tower.operation": str(operation.id),
        "tower.request_id": operation.request_id,
        "tower.drone": int(operation.drone_id),
        "tower.epoch": int(operation.epoch),
    }
    return about


def _end(span: Span | None) -> None:
    if span is not None:
        span.end()
