"""Every route with every kind of visitor, against one table. A route without a row fails the test."""

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Final

import httpx
import pytest
from every_route import BODIES, ROUTES, path_of
from fastapi.routing import APIRoute, APIWebSocketRoute
from starlette.routing import Route
from tower_world import TowerWorld, start_tower

from server.app.composition import create_app
from server.app.routers import ROUTERS
from server.kernel.people import Role
from server.runtime.settings import Settings

VISITORS: Final = ("anonymous", "stranger", "owner", "admin", "observer")
TOKENS: Final = ("for watch", "for fly", "for admin", "for metrics", "of the settings")
"""An admin's API tokens, each with one scope, and the value of TOWER_METRICS_TOKEN."""
ALL, SELF, IN_PERSON = "+ + + + +   + + + + +", "- + + + +   + + + + -", "- + + + +   x x x x -"
NOBODY = "- - - - -   - - - - -"
LOOK, OWN_LOOK, OWN_FLY = "- + + + +   + x x x -", "- . + + +   + x x x -", "- . + + x   x + x x -"
FLY = "- + + + x   x + x x -"
LEND, KEEP, LEAVE = "- . x + x   x x + x -", "- + + + x   x x + x -", "- + + + +   x x + x -"
RULE, COMMAND, METRICS = "- x x + x   x x + x -", "- . ? + x   x x x x -", "- x x + x   x x x + +"
RULE_IN_PERSON = "- x x + x   x x x x -"
"""For each visitor in turn, then for each token. +: let in (whatever the route then says of the rest of the request),
-: 401, x: 403 `admins-only`, `read-only-account`, `scope-missing`,
`in-person-only` or of the table of control, .: 404, as if there were no
such drone, ?: the table of control says, which has tests of its own."""

TABLE: Final[dict[str, str]] = {
    "sign_in": ALL,
    "sign_out": ALL,
    **dict.fromkeys(("ask_for_passkey", "sign_in_with_passkey"), ALL),
    "health": ALL,
    "ready": ALL,
    "enrol": ALL,
    **dict.fromkeys(("me", "get_preferences"), SELF),
    **dict.fromkeys(("change_own_password", "get_sessions", "end_one_session", "put_preference"), IN_PERSON),
    **dict.fromkeys(("get_proof", "renew_proof", "ask_for_proof_by_passkey", "judge_own_password"), IN_PERSON),
    **dict.fromkeys(("list_passkeys", "begin_passkey", "add_passkey"), IN_PERSON),
    **dict.fromkeys(("rename_passkey", "remove_passkey"), IN_PERSON),
    **dict.fromkeys(("get_second_factor", "begin_second_factor", "confirm_second_factor"), IN_PERSON),
    **dict.fromkeys(("renew_recovery_codes", "remove_second_factor"), IN_PERSON),
    **dict.fromkeys(("list_tokens", "create_token", "revoke_token"), IN_PERSON),
    **dict.fromkeys(("list_alert_channels", "add_alert_channel", "change_alert_channel"), IN_PERSON),
    **dict.fromkeys(("get_push_key", "add_push_channel", "keep_push_channel"), IN_PERSON),
    **dict.fromkeys(("delete_alert_channel", "confirm_alert_channel", "try_alert_channel"), IN_PERSON),
    **dict.fromkeys(("list_drones", "get_map", "get_tile_file", "get_map_file", "get_map_tile", "get_heights"), LOOK),
    **dict.fromkeys(("get_drone", "get_drone_settings", "get_loss_check", "get_rehearsal"), OWN_LOOK),
    "get_receiver_setup": OWN_LOOK,
    **dict.fromkeys(("get_preflight",), OWN_LOOK),
    **dict.fromkeys(("sign_preflight", "put_drone_checklist"), OWN_FLY),
    "get_checklist": LOOK,
    "put_checklist": RULE,
    **dict.fromkeys(
        ("acknowledge_loss_check", "rehearse_loss", "acquire", "release", "accept", "stay", "keep_alive"), OWN_FLY
    ),
    **dict.fromkeys(("take", "give", "assist", "unassist"), COMMAND),
    **dict.fromkeys(
        (
            "get_plan",
            "verify_plan",
            "foresee_plan",
            "get_parameters",
            "get_controller",
            "get_choices",
            "get_findings",
            "get_parameter_metadata",
            "read_parameters",
            "get_video",
        ),
        OWN_LOOK,
    ),
    **dict.fromkeys(("get_logs", "list_logs", "get_log_file"), OWN_LOOK),
    **dict.fromkeys(("put_plan", "clear_plan", "write_parameters", "command_drone", "fetch_log"), OWN_FLY),
    **dict.fromkeys(("start_controller", "stop_controller"), OWN_FLY),
    "write_receiver_setup": OWN_FLY,
    "set_signing_key": OWN_FLY,
    "remove_signing_key": OWN_FLY,
    **dict.fromkeys(("list_recordings", "get_recording", "get_recording_file"), OWN_LOOK),
    **dict.fromkeys(("begin_recording", "end_recording", "delete_recording"), OWN_FLY),
    **dict.fromkeys(("list_flights", "get_flight", "get_flight_tlog", "export_flight", "report_flight"), LOOK),
    **dict.fromkeys(("identify_flight", "get_flight_figures", "get_statistics", "download_statistics"), LOOK),
    **dict.fromkeys(("make_display_video", "get_display_video", "get_display_video_file"), LOOK),
    **dict.fromkeys(("get_link_quality", "download_link_quality"), LOOK),
    **dict.fromkeys(("get_log_book", "download_log_book", "list_maintenance"), LOOK),
    "add_maintenance": OWN_FLY,
    **dict.fromkeys(("change_maintenance", "end_maintenance", "remove_maintenance"), FLY),
    "delete_flight": RULE,
    **dict.fromkeys(("list_flight_imports", "get_flight_import", "get_flight_import_tlog"), LOOK),
    **dict.fromkeys(("import_flight", "delete_flight_import"), FLY),
    **dict.fromkeys(("put_agent_file", "get_agent_release"), NOBODY),
    "get_operation": LOOK,
    "cancel_operation": FLY,
    **dict.fromkeys(("get_alerts", "get_alert_rules"), LOOK),
    "acknowledge_alert": FLY,
    **dict.fromkeys(("list_missions", "get_mission"), LOOK),
    **dict.fromkeys(("create_mission", "replace_mission", "delete_mission"), FLY),
    "change_drone_settings": RULE,
    **dict.fromkeys(("list_users", "get_user"), RULE),
    **dict.fromkeys(("create_user", "change_user", "delete_user", "reset_second_factor"), RULE_IN_PERSON),
    **dict.fromkeys(("create_drone", "rename_drone", "delete_drone"), RULE),
    **dict.fromkeys(("list_agent_releases", "update_agent"), RULE),
    **dict.fromkeys(("add_owner", "remove_owner"), RULE),
    **dict.fromkeys(("lend_drone", "end_loan", "get_restraint", "restrain_drone", "end_restraint"), LEND),
    **dict.fromkeys(("list_teams", "get_team", "list_zones"), LOOK),
    "read_zone_file": KEEP,
    **dict.fromkeys(("replace_zone", "delete_zone"), KEEP),
    "create_zone": "- x x + x   x x + x -",
    **dict.fromkeys(("make_team", "rename_team", "delete_team", "set_team_member"), KEEP),
    "remove_team_member": LEAVE,
    **dict.fromkeys(("add_team_drone", "remove_team_drone", "invite_to_team", "withdraw_invitation"), KEEP),
    **dict.fromkeys(("list_invitations", "accept_invitation", "decline_invitation"), IN_PERSON),
    **dict.fromkeys(("get_map_admin", "add_map_layer", "remove_map_layer", "put_map_file", "remove_map_file"), RULE),
    **dict.fromkeys(("estimate_map_area", "keep_map_area", "let_map_area_go"), RULE),
    **dict.fromkeys(("put_elevation_file", "stop_elevation"), RULE),
    "list_enrolments": RULE,
    **dict.fromkeys(("begin_enrolment", "cancel_enrolment", "revoke_key"), RULE_IN_PERSON),
    **dict.fromkeys(("list_audit_events", "download_audit_events", "system", "who_is_online"), RULE),
    "list_towers": RULE,
    **dict.fromkeys(("list_shares", "change_share"), RULE),
    "list_given_up_deliveries": RULE,
    "drain_tower": RULE_IN_PERSON,
    "metrics": METRICS,
}
METRICS_SECRET: Final = "0123456789abcdef0123456789abcdef"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path, metrics_token=METRICS_SECRET) as running:
        yield running


def sign_of(answer: httpx.Response) -> str:
    slug = answer.json().get("type", "") if "problem" in answer.headers.get("content-type", "") else ""
    if slug.endswith(("/not-signed-in", "/session-expired", "/bad-token", "/bad-credential")):
        return "-"
    if slug.endswith(("/admins-only", "/read-only-account", "/not-an-owner", "/scope-missing", "/in-person-only")):
        return "x"
    return "." if slug.endswith("/unknown-drone") else "+"


def test_every_route_has_a_row() -> None:
    assert {route.name for route in ROUTES} == set(TABLE)
    assert all(len(row.split()) == len(VISITORS) + len(TOKENS) for row in TABLE.values())


def test_there_is_no_route_beside_the_table(tmp_path: Path) -> None:
    """The running application's routes are the table, the API description, the channels and the pages."""
    app = create_app(Settings(var=tmp_path, web=tmp_path))
    of_its_own = [route.path for route in app.routes if isinstance(route, Route)]
    assert of_its_own == ["/api/v1/openapi.json"]
    described = {operation["operationId"] for path in app.openapi()["paths"].values() for operation in path.values()}
    assert described == {route.operation_id or route.name for route in ROUTES}
    others = [
        route for router in ROUTERS for route in router.routes if not isinstance(route, APIRoute | APIWebSocketRoute)
    ]
    assert others == []
    channels = {route.path for router in ROUTERS for route in router.routes if isinstance(route, APIWebSocketRoute)}
    assert channels == {
        "/api/v1/live",
        "/api/v1/agent",
        "/api/v1/agent/video",
        "/api/v1/drones/{drone_id}/video",
    }


async def test_every_route_gives_every_visitor_what_the_table_says(world: TowerWorld) -> None:
    owner, stranger = await world.add_user("Owner"), await world.add_user("Stranger")
    observer = await world.add_user("Olga", Role.OBSERVER)
    hawk = await world.add_drone("hawk", owner, observer)
    clients = {
        "anonymous": await world.client(),
        "stranger": await world.signed_in(stranger),
        "owner": await world.signed_in(owner),
        "admin": await world.signed_in(await world.add_user("Root", Role.ADMIN)),
        "observer": await world.signed_in(observer),
    }
    for name in TOKENS:
        secret = METRICS_SECRET
        if name.startswith("for "):
            asked = {"name": name, "scopes": [name.removeprefix("for ")]}
            secret = (await clients["admin"].post("/api/v1/tokens", json=asked)).json()["secret"]
        clients[name] = await world.client(headers={"Authorization": f"Bearer {secret}"})
    wrong = []
    # Signing out comes last, because nobody is signed in after it.
    for route in sorted(ROUTES, key=lambda route: route.name == "sign_out"):
        expected = dict(zip((*VISITORS, *TOKENS), TABLE[route.name].split(), strict=True))
        # Uses a missing drone for admin-only requests, so that the drone stays.
        drone_id = 9999 if TABLE[route.name] == RULE else hawk.id
        path = path_of(route, drone_id)
        for visitor, client in clients.items():
            body = BODIES.get(route.name)
            answer = await client.request(next(iter(route.methods)), path, json=body)
            sign = sign_of(answer)
            if expected[visitor] == "+" and drone_id == 9999 and sign == ".":
                sign = "+"
            if expected[visitor] not in (sign, "?"):
                wrong.append((route.name, visitor, expected[visitor], answer.status_code, answer.text[:100]))
    assert wrong == []
