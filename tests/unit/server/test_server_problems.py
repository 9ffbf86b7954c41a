"""The table of problems: every refusal has a row, and its response matches the row."""

import importlib
import json
import pkgutil
from collections.abc import Iterator

import server
from server.accounts.store.password_policy import BadPassword
from server.accounts.store.users import SignInThrottled
from server.control.core.lease import Refused
from server.control.store.service import ControlRefused
from server.http.problem_table import PROBLEMS
from server.http.problems import kind_of, refusal_problem
from server.kernel.refusal import Refusal, RetryLater


def _all_refusals(parent: type[Refusal] = Refusal) -> Iterator[type[Refusal]]:
    for one in parent.__subclasses__():
        yield one
        yield from _all_refusals(one)


def test_every_refusal_has_its_line() -> None:
    for module in pkgutil.walk_packages(server.__path__, "server."):
        importlib.import_module(module.name)
    found = {one for one in _all_refusals() if one is not RetryLater and one.__module__.startswith("server.")}
    assert found == set(PROBLEMS)


def test_slugs_are_paths_and_one_slug_has_one_status() -> None:
    statuses: dict[str, set[int]] = {}
    for kind in PROBLEMS.values():
        assert kind.slug.replace("-", "").isalpha()
        assert 400 <= kind.status < 600
        statuses.setdefault(kind.slug, set()).add(kind.status)
    assert all(len(one) == 1 for one in statuses.values())


def test_waiting_times_are_rounded_up_for_the_header() -> None:
    answer = refusal_problem(SignInThrottled(retry_after_s=1.2), instance="/x")
    assert (answer.status_code, answer.headers["retry-after"]) == (429, "2")


def test_a_bad_member_is_named() -> None:
    document = json.loads(refusal_problem(BadPassword("too short"), instance="/x").body)
    assert document["errors"] == [{"in": "body", "field": "password", "message": "too short"}]


def test_control_answers_with_the_code_of_its_table() -> None:
    held = kind_of(ControlRefused(Refused("held-by-other", "somebody else has the controls")))
    assert (held.slug, held.status) == ("held-by-other", 409)
    admin = kind_of(ControlRefused(Refused("admins-only", "only an admin can")))
    assert (admin.slug, admin.status) == ("admins-only", 403)


def test_an_unknown_refusal_tells_nothing() -> None:
    class New(Refusal):
        pass

    answer = refusal_problem(New("inner words"), instance="/x")
    assert answer.status_code == 500
    assert b"inner words" not in answer.body
