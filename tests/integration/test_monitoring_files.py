"""Alert rules and dashboard: promtool takes them, and every metric that they name is one that the tower has."""

import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from prometheus_client.parser import text_string_to_metric_families
from tower_world import start_tower

from server.kernel.people import Role

FOLDER = Path(__file__).parents[2] / "deploy" / "monitoring"
NAME = re.compile(r"\b(?:tower|process)_[a-z0-9_]+\b")


def _alerts() -> str:
    lines = (FOLDER / "alerts.yml").read_text().splitlines()
    return "\n".join(line for line in lines if not re.match(r"\s*(#|summary:|description:)", line))


def _queries() -> Iterator[tuple[str, str]]:
    """Titles and queries of the dashboard."""
    document: Any = json.loads((FOLDER / "grafana-dashboard.json").read_text())
    for panel in document["panels"]:
        for target in panel.get("targets", ()):
            yield panel["title"], target["expr"]


async def _samples(tmp_path: Path) -> set[str]:
    async with start_tower(tmp_path) as world:
        admin = await world.signed_in(await world.add_user("Root", Role.ADMIN))
        text = (await admin.get("/metrics")).text
    found = set()
    for family in text_string_to_metric_families(text):
        # A family without samples yet still has its kind.
        ends = {"counter": ["_total"], "histogram": ["_bucket", "_sum", "_count"], "summary": ["_sum", "_count"]}
        found |= {family.name + end for end in ends.get(family.type, [""])}
        found |= {sample.name for sample in family.samples}
    return found


async def test_every_metric_of_rules_and_dashboard_exists(tmp_path: Path) -> None:
    there = await _samples(tmp_path)
    named = set(NAME.findall(_alerts()))
    assert len(named) > 10
    assert named <= there, named - there
    shown: set[str] = set()
    for title, query in _queries():
        used = set(NAME.findall(query))
        assert used, title
        assert used <= there, (title, used - there)
        shown |= used
    assert len(shown) > 30


def test_promtool_takes_rules_and_queries(tmp_path: Path, missing: Callable[[str], None]) -> None:
    promtool = shutil.which("promtool")
    if promtool is None:
        missing("promtool (Debian: apt-get install prometheus)")
    assert promtool is not None

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [str(promtool), *arguments], cwd=FOLDER, capture_output=True, text=True, timeout=60, check=False
        )

    for arguments in (("check", "rules", "alerts.yml"), ("test", "rules", "alerts_test.yml")):
        done = run(*arguments)
        assert done.returncode == 0, done.stdout + done.stderr
    # The queries of the dashboard as rules, so that promtool parses them too.
    queries = tmp_path / "queries.yml"
    rules = [
        {"record": f"query:{number}", "expr": query.replace("$__rate_interval", "1m").replace("$instance", ".*")}
        for number, (_, query) in enumerate(_queries())
    ]
    queries.write_text(json.dumps({"groups": [{"name": "queries", "rules": rules}]}))  # JSON is YAML
    done = run("check", "rules", str(queries))
    assert done.returncode == 0, done.stdout + done.stderr
    rules[0]["expr"] += " +"
    queries.write_text(json.dumps({"groups": [{"name": "queries", "rules": rules}]}))
    assert run("check", "rules", str(queries)).returncode != 0, "it would find an error"


def test_every_alert_has_words_and_a_severity() -> None:
    rules = (FOLDER / "alerts.yml").read_text().split("- alert: ")[1:]
    assert len(rules) > 10
    for rule in rules:
        name = rule.splitlines()[0]
        assert "summary:" in rule, name
        assert re.search(r"severity: (critical|warning)", rule), name


def test_panels_have_their_own_numbers() -> None:
    document: Any = json.loads((FOLDER / "grafana-dashboard.json").read_text())
    numbers = [panel["id"] for panel in document["panels"]]
    assert len(set(numbers)) == len(numbers)
    assert "__inputs" not in document, "it is imported without questions"
