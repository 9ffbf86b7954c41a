"""Traces of real requests at a collector that the test makes, and a tower whose collector is gone."""

import asyncio
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import httpx
import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.proto.trace.v1.trace_pb2 import Span, Status
from tower_world import start_tower
from worlds.free_ports import free_tcp_port
from worlds.pilot import at_the_controls
from worlds.processes import Answer, World, wait_for

from server.kernel.people import Role

TRACE, BROWSER = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"
DEADLINE_S = 60.0


class Collector:
    """Takes OTLP over HTTP, once it is `open`."""

    def __init__(self) -> None:
        self.received: list[ExportTraceServiceRequest] = []
        self.called, self.open = threading.Event(), threading.Event()
        self.open.set()

    @contextmanager
    def listening(self) -> Iterator[str]:
        collector = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                collector.called.set()
                collector.open.wait(DEADLINE_S)
                assert (self.path, self.headers["Content-Type"]) == ("/v1/traces", "application/x-protobuf")
                collector.received.append(ExportTraceServiceRequest.FromString(body))
                self.send_response(200)
                self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *_: Any) -> None:
                pass

        with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
            thread = threading.Thread(target=server.serve_forever)
            thread.start()
            try:
                yield f"http://127.0.0.1:{server.server_port}"
            finally:
                self.open.set()
                server.shutdown()
                thread.join()

    def spans(self, trace_id: str) -> dict[str, Span]:
        """Spans of one trace by their names."""
        found = [
            span
            for request in list(self.received)
            for resource in request.resource_spans
            for scope in resource.scope_spans
            for span in scope.spans
            if span.trace_id.hex() == trace_id
        ]
        named = {span.name: span for span in found}
        assert len(named) == len(found), "each once"
        return named


def attributes_of(span: Span) -> dict[str, Any]:
    return {one.key: getattr(one.value, str(one.value.WhichOneof("value"))) for one in span.attributes}


async def test_a_command_is_one_trace_from_the_browser_to_the_autopilot_and_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    collector = Collector()
    with collector.listening() as address, World(tmp_path / "world") as world:
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", address)
        monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "50")
        monkeypatch.setenv("OTEL_RESOURCE_ATTRIBUTES", "service.instance.id=north")
        world.add_user("alice")
        assert world.add_drone("Kestrel", "alice") == 1
        await asyncio.to_thread(world.start_tower)
        await asyncio.to_thread(world.start_simulated, "Kestrel", options=("--boot-s", "1", "--seed", "3"))
        alice = world.visitor("alice")
        await asyncio.to_thread(world.wait_until_online, alice, 1)
        async with at_the_controls(alice, 1):
            body = {"command": "mode", "mode": "STABILIZE"}

            def given() -> Answer | None:
                """409: the tower has not heard the heartbeat yet. Each attempt is a trace of its own."""
                nonlocal trace
                trace = f"{int(trace, 16) + 1:032x}"
                traceparent = f"00-{trace}-{BROWSER}-01"
                answer = alice.ask("POST", "/drones/1/commands", body, traceparent=traceparent)
                assert answer.status in (200, 409), answer.body
                return answer if answer.status == 200 else None

            trace = TRACE
            answer = await asyncio.to_thread(wait_for, "the command", given)
            assert answer.headers["x-request-id"] == trace
            names = ["POST /api/v1/drones/{drone_id}/commands", "operation command", "order command"]
            await asyncio.to_thread(
                wait_for, "its spans", lambda: sorted(collector.spans(trace)) == names, timeout_s=DEADLINE_S
            )
    request, operation, order = (collector.spans(trace)[name] for name in names)
    assert request.parent_span_id.hex() == BROWSER
    assert operation.parent_span_id == request.span_id
    assert order.parent_span_id == operation.span_id
    assert (request.kind, order.kind) == (Span.SPAN_KIND_SERVER, Span.SPAN_KIND_CLIENT)
    assert request.start_time_unix_nano <= operation.start_time_unix_nano <= order.start_time_unix_nano
    assert order.end_time_unix_nano <= operation.end_time_unix_nano
    assert attributes_of(request)["http.response.status_code"] == 200
    assert attributes_of(operation)["tower.operation"] == answer.json["id"]
    assert attributes_of(operation)["tower.state"] == "done"
    assert attributes_of(order)["mavlink.result"] == "MAV_RESULT_ACCEPTED"
    assert {one.status.code for one in (request, operation, order)} == {Status.STATUS_CODE_UNSET}
    assert all(attributes_of(one)["tower.request_id"] == trace for one in (request, operation))
    resource = attributes_of(collector.received[0].resource_spans[0].resource)  # type: ignore[arg-type]
    assert (resource["service.name"], resource["service.instance.id"]) == ("control-tower", "north")


async def test_a_request_without_a_traceparent_has_the_trace_of_its_request_id(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "50")
    collector = Collector()
    with collector.listening() as address:
        async with start_tower(tmp_path, telemetry_endpoint=address) as world:
            root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
            answer = await root.get("/api/v1/drones/77", headers={"traceparent": "00-0-0-01"})
            assert answer.status_code == 404
            trace = answer.headers["x-request-id"].rjust(32, "0")
            await asyncio.to_thread(wait_for, "its span", lambda: collector.spans(trace), timeout_s=DEADLINE_S)
    (span,) = collector.spans(trace).values()
    assert (span.name, span.parent_span_id) == ("GET /api/v1/drones/{drone_id}", b"")
    assert attributes_of(span)["http.response.status_code"] == 404


async def metric(client: httpx.AsyncClient, line: str) -> float:
    text = (await client.get("/metrics")).text
    return float(next(one for one in text.splitlines() if one.startswith(f"{line} ")).split()[-1])


async def test_a_collector_that_hangs_delays_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "50")
    collector = Collector()
    collector.open.clear()
    with collector.listening() as address:
        async with asyncio.timeout(DEADLINE_S), start_tower(tmp_path, telemetry_endpoint=address) as world:
            root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
            assert await asyncio.to_thread(collector.called.wait, DEADLINE_S)
            # From here on its thread waits for the collector.
            for _ in range(20):
                assert (await root.get("/api/v1/drones")).status_code == 200
            assert await metric(root, 'tower_telemetry_spans_total{outcome="sent"}') == 0
            assert await metric(root, "tower_telemetry_spans_waiting") >= 20
        # The tower has ended, and has not waited for the collector's answer.
        assert not collector.received


async def test_spans_that_no_collector_takes_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "50")
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_TIMEOUT", "1")
    address = f"http://127.0.0.1:{free_tcp_port()}"
    async with start_tower(tmp_path, telemetry_endpoint=address) as world:
        root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
        async with asyncio.timeout(DEADLINE_S):
            while not await metric(root, 'tower_telemetry_spans_total{outcome="failed"}'):  # noqa: ASYNC110
                await asyncio.sleep(0.05)  # a thread of the tower counts it


def test_no_exporter_is_imported_while_it_is_off(tmp_path: Path) -> None:
    """FastAPI itself imports the API of OpenTelemetry."""
    program = (
        "import sys\n"
        "from server.app.composition import create_app\n"
        "from server.runtime.settings import read_settings\n"
        f"create_app(read_settings({{'TOWER_VAR': {str(tmp_path)!r}}}))\n"
        "prefixes = ('opentelemetry.sdk', 'opentelemetry.exporter', 'requests', 'google')\n"
        "print([one for one in sys.modules if one.startswith(prefixes)])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_tower_without_the_extra_says_what_is_missing(tmp_path: Path) -> None:
    program = (
        "import sys\n"
        "sys.modules['opentelemetry.sdk'] = None\n"
        "from server.app.composition import create_app\n"
        "from server.runtime.settings import read_settings\n"
        f"settings = {{'TOWER_VAR': {str(tmp_path)!r}, 'OTEL_EXPORTER_OTLP_ENDPOINT': 'http://127.0.0.1:4318'}}\n"
        "create_app(read_settings(settings))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    wanted = "OTEL_EXPORTER_OTLP_ENDPOINT needs OpenTelemetry: pip install 'control-tower[telemetry]'"
    assert done.stderr.strip().endswith(wanted), done.stderr
