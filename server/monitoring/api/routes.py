"""`/metrics`: for Prometheus, and for admins."""

from __future__ import annotations

import hmac
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from prometheus_client import CollectorRegistry, GCCollector, PlatformCollector, ProcessCollector
from prometheus_client.exposition import choose_encoder

from server.anonymous.api.anonymous_scope import admitted
from server.http.authentication import token_in
from server.http.dependencies import AuthenticatorDep, MetricsRegistryDep, Parts, SettingsDep
from server.http.problem_docs import answers
from server.kernel.access import Action, AdminsOnly, BadToken, NotSignedIn, ScopeMissing, SessionExpired
from server.monitoring.api.anonymous import AnonymousCollector
from server.monitoring.api.collector import RelayCollector
from server.monitoring.api.disk import DiskCollector
from server.monitoring.api.flights import FlightCollector
from server.monitoring.api.recordings import RecordingCollector
from server.monitoring.api.upkeep import UpkeepCollector

router = APIRouter(tags=["metrics"])


async def _may_read(request: Request, settings: SettingsDep, authenticator: AuthenticatorDep) -> None:
    """Requires TOWER_METRICS_TOKEN, an API token with the metrics scope, or an admin's session."""
    secret, shown = settings.metrics_token, token_in(request.headers)
    if secret and shown is not None and hmac.compare_digest(secret.encode(), shown.encode()):
        admitted(request)  # a flood of strangers must not keep the figures of the flood from whoever watches it
        return
    await authenticator.admit(request, Action.READ_METRICS)


_may_read.action = Action.READ_METRICS  # type: ignore[attr-defined]  # for the test that walks all routes


def new_registry(parts: Parts) -> CollectorRegistry:
    """One registry per tower, so that a second tower in the same process (tests) counts separately."""
    registry = CollectorRegistry()
    registry.register(RelayCollector(parts.hub, parts.database, parts.loop_watch.held_s))
    registry.register(AnonymousCollector(parts.anonymous))
    registry.register(RecordingCollector(parts.recordings))
    registry.register(FlightCollector(parts.flights))
    registry.register(DiskCollector(parts.settings.var))
    upkeep = UpkeepCollector(parts.database, parts.lock, parts.retention, parts.alert_deliverer, parts.alert_writer)
    registry.register(upkeep)
    ProcessCollector(registry=registry)
    PlatformCollector(registry=registry)
    GCCollector(registry=registry)
    return registry


@router.get(
    "/metrics",
    response_class=Response,
    responses=answers(NotSignedIn, SessionExpired, BadToken, AdminsOnly, ScopeMissing),
)
async def metrics(request: Request, registry: MetricsRegistryDep, _: Annotated[None, Depends(_may_read)]) -> Response:
    """Returns the metrics of docs/metrics.md, in Prometheus text format or OpenMetrics, as the client accepts."""
    encode, content_type = choose_encoder(request.headers.get("accept", ""))
    return Response(encode(registry), headers={"Content-Type": content_type, "Cache-Control": "no-store"})
