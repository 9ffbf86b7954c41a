"""Assembles the tower: the only module that knows every capability. Nothing is opened before the lifespan begins."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from urllib.parse import urlsplit

from server import VERSION
from server.accounts.core.challenges import Challenges
from server.accounts.core.throttle import SignInThrottle
from server.accounts.store.hashing_process import HashingProcess
from server.accounts.store.known_addresses import remember_addresses
from server.accounts.store.passkey_sign_in import PasskeySignInService
from server.accounts.store.password_policy import PasswordPolicy
from server.accounts.store.passwords import Passwords
from server.accounts.store.sealed_factors import prepare_vault
from server.accounts.store.sessions import Sessions
from server.accounts.store.sign_in import SignInService
from server.accounts.store.tokens import ApiTokens
from server.alerts.store.channels.channels import reseal_channels
from server.alerts.store.left_behind import LeftBehind
from server.alerts.store.loading import load_alerts
from server.alerts.store.takeover import AlertTakeover
from server.alerts.store.writer import AlertWriter
from server.anonymous.api.request_gate import RequestGate
from server.anonymous.core.budget import AnonymousBudget, Over
from server.app.aircraft_feed import AircraftFeed
from server.app.alert_parts import new_alert_deliverer
from server.app.new_hub import new_hub
from server.app.routers import PARTS, ROUTERS, TAGS, included_routes
from server.app.sharing import new_lock, share_bus, share_requests
from server.app.telemetry_parts import new_tracing, trace_requests
from server.app.tower import Tower, TowerApp
from server.app.tower_watch import TowerWatch
from server.audit.store.sealer import AuditSealer
from server.control.store.after_start import end_assistance
from server.control.store.hub_event_handler import HubEventHandler
from server.control.store.lease_store import DatabaseLeaseStore
from server.control.store.loss_checks import LossChecks
from server.control.store.open_hold_store import load_open_holds
from server.control.store.rehearsal import Rehearsals
from server.control.store.service import ControlService
from server.control.store.settings_store import load_into
from server.fleet.store.drones import deleted_among
from server.fleet.store.enrolment_notifier import EnrolmentNotifier
from server.fleet.store.exchange import CredentialExchange
from server.fleet.store.loans import LoanExpiry
from server.fleet.store.roster import Roster
from server.fleet.store.tower_identity import TowerIdentity, check_key_is_there
from server.flights.store.flights import new_flights
from server.http.authentication import Authenticator
from server.http.body import BodyCheck
from server.http.console import serve_console
from server.http.cookie_prefix import CookiePrefix
from server.http.database_wait import BoundedDatabaseWait
from server.http.dependencies import provide, provide_data_endpoint
from server.http.guards import UnexpectedErrors
from server.http.only_the_tower import OnlyTheTower
from server.http.openapi_file import serve_openapi
from server.http.origin import OriginCheck
from server.http.over_tls import OverTls
from server.http.part import Common, Services
from server.http.prepare_routes import prepare_routes
from server.http.problem_docs import describe_problems
from server.http.problems import handle_problems
from server.http.remembered import RememberedSignIns
from server.http.request_cost import RequestCost
from server.http.request_ids import RequestIds
from server.http.request_shares import RequestShares
from server.http.security_headers import SecurityHeaders
from server.http.security_txt import PATH as SECURITY_TXT
from server.http.security_txt import security_txt
from server.kernel.clock import Clock, utc_now
from server.kernel.shares import ShareName
from server.link.api.agent_sign_in import SignInRules, is_agent
from server.link.api.fault_log import FaultLog
from server.link.api.running import running_relay
from server.link.api.tls_binding import TlsBinding
from server.logs.store.quota import new_flight_log_quota
from server.logs.store.receiving import LogReceiver
from server.monitoring.api import routes as metrics_routes
from server.operations.store import OperationAuditWriter
from server.runtime.aligned_timers import SharedChecks
from server.runtime.background import in_background
from server.runtime.garbage import unsearched
from server.runtime.listening import CannotListen
from server.runtime.loop_watch import LoopWatch
from server.runtime.private_files import make_private_folder
from server.runtime.settings import Settings
from server.runtime.side_thread import SideThread
from server.storage.database import open_database
from server.storage.file_accounts import file_accounts
from server.storage.retention import new_retention
from server.storage.schema import check_schema
from server.video.store.capture import HubVideo
from server.video.store.recordings import new_recordings


def create_app(settings: Settings, *, clock: Clock = utc_now) -> TowerApp:
    tower = _compose(settings, clock)
    app = TowerApp(
        tower,
        title="Control Tower",
        version=VERSION,
        description="Fly and watch drones through the internet. Live data is on the WebSocket `/api/v1/live`.",
        openapi_tags=[{"name": name, "description": about} for name, about in TAGS.items()],
        lifespan=_lifespan,
        docs_url=None,  # the default pages load scripts from elsewhere
        redoc_url=None,
        openapi_url=None,  # see serve_openapi
        redirect_slashes=False,
    )
    registry = metrics_routes.new_registry(tower)
    provide(app, tower, registry)
    handle_problems(app)
    describe_problems(app, [route for router in ROUTERS for route in router.routes])
    serve_openapi(app, tower.side_thread)
    app.router.routes.extend(included_routes())
    security_contact_text = partial(security_txt, settings.security_contact, settings.public_url)
    serve_console(app, settings.web, {SECURITY_TXT: lambda: security_contact_text(clock())})
    # The last middleware added is the outermost.
    app.add_middleware(BoundedDatabaseWait, database=tower.database)
    if tower.tracing is not None:
        trace_requests(app, tower.tracing, registry)
    if tower.several is not None:
        share_requests(app, tower.hub, tower.several, tower.authenticator, registry)
    app.add_middleware(OnlyTheTower, may_act=tower.lock.may_act, confirmed=tower.lock.confirmed)
    app.add_middleware(BodyCheck, budget=tower.anonymous)
    app.add_middleware(OriginCheck, settings=settings)
    app.add_middleware(UnexpectedErrors)
    over_tls = OverTls(settings.public_url)
    app.add_middleware(CookiePrefix, over_tls=over_tls)
    app.add_middleware(SecurityHeaders, api_prefix="/api/", over_tls=over_tls)
    app.add_middleware(RequestGate, budget=tower.anonymous, is_vouched=partial(is_agent, tower.hub))
    app.add_middleware(RequestIds)
    app.add_middleware(RequestCost, shares=tower.authenticator.requests)
    return app


def _compose(settings: Settings, clock: Clock) -> Tower:
    database = open_database(settings.database_url, timeout_s=settings.database_timeout_s)
    lock = new_lock(settings, clock)
    database.guard = lock.check
    vault = settings.vault()
    anonymous = AnonymousBudget(now=time.monotonic(), trusted_proxies=settings.trusted_proxies)
    passwords = Passwords(
        concurrency=settings.argon2_concurrency,
        memory_kib=settings.argon2_memory_kib,
        rounds=settings.argon2_rounds,
        budget=anonymous,
        hashing=HashingProcess(settings.argon2_concurrency) if settings.argon2_process else None,
    )
    throttle = SignInThrottle(
        anonymous.known, anonymous.limits, on_refused=lambda: anonymous.refused.update((Over.GUESSES,))
    )
    sessions = Sessions(
        database,
        idle_s=settings.session_idle_s,
        lifetime_s=settings.session_lifetime_s,
        admins_need_second_factor=settings.admins_need_second_factor,
    )
    api_tokens = ApiTokens(database, admins_need_second_factor=settings.admins_need_second_factor)
    hub = new_hub(settings, clock)
    database.on_write = partial(hub.state.shares.note, ShareName.WRITES)
    loss_checks = LossChecks(hub=hub, database=database, clock=clock)
    rehearsals = Rehearsals(hub=hub, database=database, clock=clock)
    roster = Roster(database, hub, clock)
    enrolment_notifier = EnrolmentNotifier(database, hub, clock)
    leases, timeout_s = DatabaseLeaseStore(database, clock), settings.database_timeout_s
    control = ControlService(leases, hub, on_changed=loss_checks.recheck, timeout_s=timeout_s)
    flight_log_quota = new_flight_log_quota(settings)
    recordings = new_recordings(settings, hub=hub, video=HubVideo(hub), database=database, clock=clock)
    flights = new_flights(settings, hub=hub, database=database, clock=clock)
    identity = TowerIdentity()
    retention = new_retention(
        settings,
        database,
        clock,
        logs=flight_log_quota,
        recordings=recordings.quota,
        flights=flights.quota,
        key=identity,
    )
    event_handler = HubEventHandler(
        service=control,
        hub=hub,
        database=database,
        clock=clock,
        loss_checks=loss_checks,
        rehearsals=rehearsals,
        agent_linked=enrolment_notifier.agent_linked,
    )
    audit_writer = OperationAuditWriter(database, clock)
    hub.operations.on_began, hub.operations.on_ended = audit_writer.began, audit_writer.ended
    hub.observed.on_settled = audit_writer.observed
    alert_writer = AlertWriter(database, clock, hub.state.shares)
    hub.alerts.listeners.append(alert_writer.changed)
    announcer, alert_deliverer = new_alert_deliverer(settings, hub, database, vault, clock)
    requests = RequestShares(hub.state.shares)
    side_thread = SideThread("side", hub.state.shares, on_spent=requests.spent)
    common = Common(settings=settings, clock=clock, database=database, hub=hub, vault=vault, side_thread=side_thread)
    return Tower(
        settings=settings,
        clock=clock,
        database=database,
        lock=lock,
        vault=vault,
        passwords=passwords,
        password_policy=PasswordPolicy(urlsplit(settings.public_url).hostname or ""),
        sessions=sessions,
        api_tokens=api_tokens,
        authenticator=Authenticator(
            sessions,
            api_tokens,
            clock,
            database=database,
            remembered=RememberedSignIns(hub.fleet.is_current),
            revision=lambda: hub.fleet.revision,
            requests=requests,
        ),
        sign_in=SignInService(database, passwords, sessions, throttle, vault),
        passkey_sign_in=PasskeySignInService(database, sessions, Challenges()),
        hub=hub,
        alert_writer=alert_writer,
        announcer=announcer,
        alert_deliverer=alert_deliverer,
        control=control,
        roster=roster,
        loan_expiry=LoanExpiry(database, hub, roster, clock),
        loss_checks=loss_checks,
        rehearsals=rehearsals,
        event_handler=event_handler,
        several=share_bus(settings, lock, hub, leases, control, database, clock, loss_checks, event_handler, vault),
        tracing=new_tracing(settings, hub),
        enrolment_notifier=enrolment_notifier,
        sign_in_rules=SignInRules(
            identity=identity,
            binding=TlsBinding(settings.tls_certificate),
            credentials_until=settings.drone_credentials_until,
            exchange=CredentialExchange(database, roster, clock),
        ),
        audit_writer=audit_writer,
        audit_sealer=AuditSealer(database, clock, identity),
        flight_log_quota=flight_log_quota,
        log_receiver=LogReceiver(flight_log_quota, lambda: file_accounts(hub)),
        recordings=recordings,
        flights=flights,
        retention=retention,
        loop_watch=LoopWatch(),
        side_thread=side_thread,
        anonymous=anonymous,
        started_at=clock(),
        shared_checks=SharedChecks(),
        services=Services(one for part in PARTS for one in part.services(common)),
        common=common,
    )


async def _deleted_with_files(tower: Tower) -> frozenset[int]:
    """Returns deleted drones that still have files."""
    parts = tower.flight_log_quota, tower.recordings.store, tower.flights.files
    there = await asyncio.to_thread(lambda: frozenset().union(*(one.drone_ids() for one in parts)))
    async with tower.database.reading() as session:
        return await deleted_among(session, there - frozenset(sorted(tower.hub.state.drones)))


@asynccontextmanager
async def _lifespan(app: TowerApp) -> AsyncIterator[None]:
    tower = app.tower
    settings = tower.settings
    async with AsyncExitStack() as stack:
        stack.push_async_callback(tower.database.close)
        stack.push_async_callback(tower.passwords.close)
        stack.callback(tower.password_policy.close)
        stack.callback(tower.side_thread.close)
        if tower.tracing is not None:
            tower.tracing.open()
            stack.push_async_callback(tower.tracing.close)
        await asyncio.to_thread(make_private_folder, settings.var)
        await check_schema(tower.database)
        if tower.several is not None:
            stack.push_async_callback(tower.several.close)
            await tower.several.open()
        stack.push_async_callback(tower.lock.release)
        if not tower.lock.is_taken:
            await tower.lock.take(waits=False)
        await stack.enter_async_context(in_background("tower lock", tower.lock.keep))
        await check_key_is_there(tower.vault, tower.database)
        await prepare_vault(tower.vault, tower.database)
        await tower.sign_in_rules.identity.load(tower.vault, tower.database)
        await reseal_channels(tower.vault, tower.database)
        await tower.alert_deliverer.push_key.load(tower.vault, tower.database)
        await tower.passwords.warm_up()
        await tower.database.warm_up()
        await remember_addresses(tower.anonymous.known, tower.database)
        if tower.several is None:  # else each drone's home does, when it becomes that
            await end_assistance(tower.database, tower.clock)
        tower.lock.on_running_out = tower.hold_flown_by_hand
        several = tower.several
        tower.hub.state.on_event = tower.event_handler.noticed if several is None else several.claims.noticed
        stack.push_async_callback(tower.event_handler.stop)
        stack.push_async_callback(tower.control.stop)
        stack.push_async_callback(tower.rehearsals.stop)
        stack.push_async_callback(tower.enrolment_notifier.stop)
        await tower.loss_checks.load()
        await tower.roster.refresh()
        await load_into(tower.hub, tower.database)
        for part in PARTS:
            if part.running is not None:
                await stack.enter_async_context(part.running(tower.common, tower.services))
        if several is None:
            await load_open_holds(tower.hub, tower.database)
            await load_alerts(tower.hub, tower.announcer, tower.database, tower.clock)
        deleted = await _deleted_with_files(tower)
        await asyncio.to_thread(tower.flight_log_quota.sweep, deleted)
        await stack.enter_async_context(tower.recordings.working(deleted))
        await stack.enter_async_context(tower.flights.working(deleted))
        tower.hub.alerts.tower = tower.flights.files.id if several is not None else ""
        for drone_id in sorted(tower.hub.state.drones):
            tower.loss_checks.recheck(drone_id)
        await stack.enter_async_context(in_background("roster", tower.roster.follow))
        await stack.enter_async_context(in_background("loans", tower.loan_expiry.watch))
        await stack.enter_async_context(in_background("operations trail", tower.audit_writer.work))
        await stack.enter_async_context(in_background("audit chain", tower.audit_sealer.work))
        if settings.traffic_feed:
            feed = AircraftFeed(settings.traffic_feed, tower.hub.aircraft)
            await stack.enter_async_context(in_background("aircraft feed", feed.follow))
        await stack.enter_async_context(in_background("alerts", tower.alert_writer.work))
        stack.callback(tower.alert_deliverer.close)
        await stack.enter_async_context(in_background("alert channels", tower.alert_deliverer.work))
        stack.callback(tower.hub.observed.settle_all)
        stack.push_async_callback(tower.api_tokens.write_uses)
        await stack.enter_async_context(in_background("token uses", tower.api_tokens.keep_writing_uses))
        await stack.enter_async_context(in_background("retention", tower.retention.work))
        await stack.enter_async_context(in_background("loop watch", tower.loop_watch.watch))
        faults = FaultLog(tower.hub.state.traffic)
        tower.hub.state.on_fault = faults.note
        tower_watch = TowerWatch(settings, tower.hub.alerts, tower.loop_watch, faults)
        await stack.enter_async_context(in_background("tower watch", tower_watch.work))
        if several is not None:
            takeover = AlertTakeover(tower.hub, tower.database, tower.clock, tower.alert_writer, tower.announcer)
            several.claims.on_came = takeover.came
            await stack.enter_async_context(in_background("alerts of other towers", takeover.work))
            several.keeps_alerts_as(tower.hub.alerts.tower)
            left = LeftBehind(
                *(tower.hub, tower.database, tower.clock, tower.alert_writer, tower.announcer),
                alert_towers=several.alert_subjects,
                is_first=several.is_first,
            )
            await stack.enter_async_context(in_background("alerts that were left", left.work))
            await stack.enter_async_context(several.running(tower.roster))
        with unsearched():
            prepare_routes(app)
        # Last: from here on agents get responses.
        try:
            relay = running_relay(
                tower.hub,
                tower.anonymous,
                host=settings.udp_host,
                port=settings.udp_port,
                may_act=tower.lock.may_act,
            )
            provide_data_endpoint(app, await stack.enter_async_context(relay))
        except OSError as error:
            raise CannotListen("TOWER_UDP_PORT", settings.udp_host, settings.udp_port, error) from error
        tower.before_shutdown.append(_good_bye(tower))
        yield


def _good_bye(tower: Tower) -> Callable[[], Awaitable[None]]:
    async def close_all() -> None:
        tower.hub.close_all()

    return close_all
