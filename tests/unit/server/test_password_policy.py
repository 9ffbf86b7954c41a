"""New passwords: long enough, hard to guess, and judged at a bounded cost."""

import ast
import asyncio
import inspect
import time

import pytest
from zxcvbn import feedback

from server.accounts.store import password_policy
from server.accounts.store.password_policy import (
    BadPassword,
    PasswordPolicy,
    TooManyJudgements,
    check_password,
    judge_password,
)
from server.accounts.store.passwords import generate_password


@pytest.mark.parametrize(
    "good",
    [
        "four words are longer",
        "m-ObhlO22RYkC18W",
        "Kestrel fliegt über Zürich",
        "483610529748 north",
        pytest.param(generate_password(), id="generated"),
    ],
)
def test_what_is_taken(good: str) -> None:
    check_password(good)


@pytest.mark.parametrize(
    ("bad", "why"),
    [
        ("", "at least 12"),
        ("kq8#Vz!p2Lw", "at least 12"),
        ("x" * 257, "at most 256"),
        ("password", "at least 12"),
        ("12345678", "at least 12"),
        ("password1234", "easy to guess"),
        ("123456789012", "easy to guess"),
        ("qwertyuiop12", "easy to guess"),
        ("P4$$w0rd1234", "easy to guess"),
        (" " * 12, "easy to guess"),
        ("x" * 256, "easy to guess"),
    ],
)
def test_what_is_not(bad: str, why: str) -> None:
    with pytest.raises(BadPassword, match=why):
        check_password(bad)


def test_every_warning_of_the_library_has_our_words() -> None:
    tree = ast.parse(inspect.getsource(feedback))
    told = [call.args[0] for call in ast.walk(tree) if isinstance(call, ast.Call) and ast.unparse(call.func) == "_"]
    texts = {one.value for one in told if isinstance(one, ast.Constant)}
    suggestions = {
        one.value
        for holder in ast.walk(tree)
        if isinstance(holder, ast.List) or (isinstance(holder, ast.Call) and "append" in ast.unparse(holder.func))
        for one in ast.walk(holder)
        if isinstance(one, ast.Constant)
    }
    suggestions |= {"Add another word or two. Uncommon words are better."}
    assert texts - suggestions == set(password_policy._WARNINGS)


@pytest.mark.parametrize(
    ("bad", "why"),
    [("111111111111", "it repeats a character"), ("abcdefghijkl", "it has letters or digits in their order")],
)
def test_what_makes_it_easy_to_guess_is_told(bad: str, why: str) -> None:
    assert judge_password(bad).message == f"this password is easy to guess, because {why}: add another word or two"


def test_names_that_an_attacker_tries_first_count_for_nothing() -> None:
    """The same letters are good for another user."""
    password = "brunhildefalkenauge"
    assert judge_password(password).acceptable
    assert not judge_password(password, ["Brunhilde Falkenauge", "falkenauge", "brunhilde"]).acceptable


@pytest.mark.parametrize("hostile", ["4@8({[</369&#!1/|0$5+7%2" * 10, "17|1|7" * 40, "a1" * 128, "ab" * 128])
def test_no_password_costs_much_to_judge(hostile: str) -> None:
    """Compared with the same library on the same machine: 72 such characters take it over a hundred times as long."""
    judge_password("warmed up by this one")

    def cost_s(password: str) -> float:
        began = time.thread_time()
        judge_password(password)
        return time.thread_time() - began

    usual_s = max(min(cost_s("correct horse battery staples") for _ in range(5)), 1e-4)
    assert min(cost_s(hostile) for _ in range(3)) < 60 * usual_s


async def test_it_is_judged_beside_the_loop_few_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    policy = PasswordPolicy("tower.example.org")
    try:
        assert not (await policy.judge("towerexample")).acceptable
        monkeypatch.setattr(password_policy, "MAX_WAITING", 2)
        asked = [asyncio.create_task(policy.judge("four words are longer")) for _ in range(3)]
        done = await asyncio.gather(*asked, return_exceptions=True)
        assert [isinstance(one, TooManyJudgements) for one in done] == [False, False, True]
    finally:
        policy.close()
