"""A span for each REST request that this tower carries out. Plain ASGI; inside of what refuses strangers.

FastAPI has spans of its own. They begin before a request has its id and before strangers are refused, and show
addresses and queries.
"""

from __future__ import annotations

from typing import Final

from opentelemetry.context import Context
from opentelemetry.trace import SpanKind, StatusCode
from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.monitoring.api.tracing.tracing import Tracing
from server.runtime.request_id import current_request_id

_W3C: Final = TraceContextTextMapPropagator()


class RequestSpans:
    """Its parent is the one in `traceparent`, if the request has it. Names hold the route, never ids or secrets."""

    def __init__(self, app: ASGIApp, *, tracing: Tracing) -> None:
        self._app = app
        self._tracing = tracing

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or not scope["path"].startswith("/api/"):
            await self._app(scope, receive, send)
            return
        status = 500
        method = scope["method"]

        async def send_and_see(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        with self._tracing.tracer.start_as_current_span(
            method,
            context=_W3C.extract(dict(Headers(scope=scope)), Context()),
            kind=SpanKind.SERVER,
            attributes={"http.request.method": method, "tower.request_id": current_request_id()},
            record_exception=False,
            set_status_on_exception=False,
        ) as span:
            try:
                await self._app(scope, receive, send_and_see)
            finally:
                route = getattr(scope.get("route"), "path", "")
                if route:
                    span.update_name(f"{method} {route}")
                    span.set_attribute("http.route", route)
                span.set_attribute("http.response.status_code", status)
                if status >= 500:
                    span.set_status(StatusCode.ERROR)
