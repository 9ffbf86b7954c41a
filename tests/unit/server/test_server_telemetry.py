"""Traces: ids that follow from request ids, spans of operations, and a queue that never waits."""

import threading
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any, cast

import pytest
from opentelemetry.sdk.trace import ReadableSpan, TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor, SpanExporter, SpanExportResult
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.trace import StatusCode

from server.kernel.people import UserRef
from server.monitoring.api.tracing.operation_spans import MAX_OPEN, OperationSpans
from server.monitoring.api.tracing.span_queue import AT_ONCE, MAX_WAITING, SpanQueue
from server.monitoring.api.tracing.tracing import Tracing, trace_id_of
from server.operations.core.operation import Lane, Operation, Order, State, Step
from wire.ids import DroneId, Epoch, UserId
from wire.transactions import LogListWork, Outcome, TransactionResult

DEADLINE_S = 30.0


@pytest.mark.parametrize(
    ("request_id", "trace_id"),
    [
        ("4bf92f3577b34da6a3ce929d0e0e4736", 0x4BF92F3577B34DA6A3CE929D0E0E4736),
        ("a3ce929d0e0e4736", 0xA3CE929D0E0E4736),
        ("", 0),
    ],
)
def test_the_trace_id_is_the_request_id(request_id: str, trace_id: int) -> None:
    assert trace_id_of(request_id) == trace_id


def test_another_request_id_has_a_trace_id_of_its_own() -> None:
    made = trace_id_of("3f9a01c2.17")
    assert made == trace_id_of("3f9a01c2.17")
    assert made != trace_id_of("3f9a01c2.18")
    assert 0 < made < 1 << 128


class Scene:
    def __init__(self) -> None:
        self.exported = InMemorySpanExporter()
        provider = TracerProvider(shutdown_on_exit=False)
        provider.add_span_processor(SimpleSpanProcessor(self.exported))
        tracing = Tracing("http://127.0.0.1:4318")
        tracing.tracer = self.tracer = provider.get_tracer("test")
        self.spans = OperationSpans(tracing)

    def named(self, name: str) -> list[ReadableSpan]:
        return [one for one in self.exported.get_finished_spans() if one.name == name]


ALICE = UserRef(UserId(1), "alice")


def operation(number: int = 7, *, by: UserRef | None = ALICE) -> Operation:
    step = Step(LogListWork(), 1.0, "reading")
    order = Order("log_list", Lane.LOGS, (step, step), writes=False)
    return Operation(
        id=number,
        drone_id=DroneId(1),
        drone_name="Kestrel",
        order=order,
        by=by,
        epoch=Epoch(3),
        began_at=datetime(2026, 1, 1, tzinfo=UTC),
        request_id="request-7",
        next_step=1,
        transaction_id=number,
    )


def test_an_operation_is_within_its_request_and_its_orders_within_it() -> None:
    scene, one = Scene(), operation()
    with scene.tracer.start_as_current_span("POST") as request:
        scene.spans.ordered(one)
    scene.spans.answered(one, TransactionResult(id=7, outcome=Outcome.DONE, words="", code="MAV_RESULT_ACCEPTED"))
    one.next_step = 2
    scene.spans.ordered(one)
    scene.spans.answered(one, TransactionResult(id=7, outcome=Outcome.REFUSED, words=""))
    one.state = State.REFUSED
    scene.spans.ended(one)
    (whole,) = scene.named("operation log_list")
    first, second = scene.named("order log_list")
    assert whole.parent == request.get_span_context()
    assert first.parent == second.parent == whole.context
    assert dict(first.attributes or {}) == {
        "tower.transaction": 7,
        "tower.step": 1,
        "tower.phase": "reading",
        "tower.outcome": "done",
        "mavlink.result": "MAV_RESULT_ACCEPTED",
    }
    assert (whole.attributes or {})["tower.request_id"] == "request-7"
    assert [one.status.status_code for one in (first, second, whole)] == [
        StatusCode.UNSET,
        StatusCode.ERROR,
        StatusCode.ERROR,
    ]


def test_an_order_that_nobody_answers_says_so_and_a_late_end_is_none() -> None:
    scene, one = Scene(), operation()
    scene.spans.ordered(one)
    one.state = State.TIMED_OUT
    scene.spans.ended(one)
    scene.spans.answered(one, TransactionResult(id=7, outcome=Outcome.DONE, words=""))
    scene.spans.ended(one)
    (order,) = scene.named("order log_list")
    assert (order.status.status_code, order.status.description) == (StatusCode.ERROR, "no answer")
    assert len(scene.exported.get_finished_spans()) == 2


def test_what_the_tower_does_by_itself_has_no_spans_and_their_number_is_bounded() -> None:
    scene = Scene()
    scene.spans.ordered(operation(by=None))
    for number in range(MAX_OPEN + 5):
        scene.spans.ordered(operation(number))
    assert len(scene.spans._open) == MAX_OPEN
    scene.spans.ended(operation(MAX_OPEN + 1))
    assert not scene.exported.get_finished_spans()


class Stuck(SpanExporter):
    """A collector that answers once `released`, with `result`."""

    def __init__(self, result: SpanExportResult | Exception = SpanExportResult.SUCCESS) -> None:
        self.released, self.reached = threading.Event(), threading.Event()
        self.result = result
        self.threads: set[int] = set()

    def export(self, spans: Sequence[ReadableSpan]) -> SpanExportResult:
        self.threads.add(threading.get_ident())
        self.reached.set()
        assert self.released.wait(DEADLINE_S)
        if isinstance(self.result, Exception):
            raise self.result
        return self.result


def fill(queue: SpanQueue, count: int) -> None:
    provider = TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(queue)
    tracer = provider.get_tracer("test")
    for _ in range(count):
        tracer.start_span("one").end()


def test_a_stuck_collector_costs_spans_that_are_counted_and_nothing_else() -> None:
    collector = Stuck()
    queue = SpanQueue(collector)
    fill(queue, AT_ONCE)
    assert collector.reached.wait(DEADLINE_S)
    fill(queue, MAX_WAITING)  # would wait here for ever if it waited for the collector
    assert queue.counts == {"sent": 0, "failed": 0, "dropped": AT_ONCE}
    assert queue.waiting == MAX_WAITING
    collector.released.set()
    queue.shutdown()
    assert queue.counts == {"sent": MAX_WAITING, "failed": 0, "dropped": AT_ONCE}
    assert queue.waiting == 0
    assert threading.get_ident() not in collector.threads


@pytest.mark.parametrize("result", [SpanExportResult.FAILURE, RuntimeError("gone")])
def test_what_the_collector_does_not_take_is_counted(result: Any) -> None:
    collector = Stuck(cast("SpanExportResult", result))
    collector.released.set()
    queue = SpanQueue(collector)
    fill(queue, 3)
    queue.shutdown()
    assert queue.counts == {"sent": 0, "failed": 3, "dropped": 0}
    assert queue.waiting == 0
