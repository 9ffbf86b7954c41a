"""The console tells every action of the audit trail in a sentence, and filters by its kind."""

import ast
import re
from pathlib import Path

from server.control.core.lease_types import Event
from wire.control_messages import HoldStep

ROOT = Path(__file__).resolve().parents[3]
WORDS = (ROOT / "web" / "src" / "words" / "audit_words.ts").read_text()
ACTION = re.compile(r"[a-z]+\.[a-z_]+")
RECORDS = {"record", "_record", "_note", "_remove", "remove", "_write"}


def names(node: ast.expr) -> set[str]:
    if isinstance(node, ast.IfExp):
        return names(node.body) | names(node.orelse)
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and ACTION.fullmatch(node.value):
        return {node.value}
    return set()


def recorded() -> set[str]:
    """Every action that is written by its name. Those of the controls and of holds are made of their enumerations."""
    found = {"command.given"}
    for module in (ROOT / "server").rglob("*.py"):
        for call in ast.walk(ast.parse(module.read_text())):
            if not isinstance(call, ast.Call):
                continue
            callee = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
            if callee in RECORDS:
                for value in (*call.args, *(one.value for one in call.keywords)):
                    found |= names(value)
    return found


def test_every_action_has_a_sentence_and_a_kind() -> None:
    actions = recorded()
    assert len(actions) > 70
    told = set(re.findall(r"^  '([a-z]+\.[a-z_]+)':", WORDS, re.M))
    assert actions - told == set()
    kinds = set(re.findall(r"^  \['([a-z]+)', ", WORDS, re.M))
    assert {action.partition(".")[0] for action in actions} - kinds == set()
    assert {"control", "hold"} <= kinds


def test_every_change_of_the_controls_and_every_end_of_a_hold_has_a_sentence() -> None:
    controls = WORDS[WORDS.index("const CONTROL") : WORDS.index("const SENTENCES")]
    assert {event.value for event in Event} == set(re.findall(r"^  '?([a-z-]+)'?: \(", controls, re.M))
    for step in HoldStep:
        assert not step.final or f"'hold.{step.value}'" in WORDS
