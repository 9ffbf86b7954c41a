"""What tests cost: the kinds of programs, and the growth of a change on a machine of any pace."""

import pytest
from check_costs import growth
from worlds.costs import kind_of, sum_of, table_of

KNOWN = {f"tests/unit/test_{number}.py": {"cpu": 2.0 + number, "wall": 1.0} for number in range(20)}


def times(factor: float) -> dict[str, dict[str, float]]:
    return {module: {"tests": costs["cpu"] * factor} for module, costs in KNOWN.items()}


@pytest.mark.parametrize("pace", [0.5, 1.0, 2.3])
def test_a_slower_machine_is_no_growth(pace: float) -> None:
    assert growth(KNOWN, times(pace)) == (0.0, {})


@pytest.mark.parametrize("pace", [0.5, 1.0, 2.3])
def test_a_new_module_counts_at_the_pace_of_the_known_ones(pace: float) -> None:
    now = times(pace) | {"tests/unit/test_new.py": {"tests": 11.5 * pace}}
    share, changed = growth(KNOWN, now)
    assert changed == {"tests/unit/test_new.py": pytest.approx(11.5)}
    assert share == pytest.approx(11.5 / sum(costs["cpu"] for costs in KNOWN.values()))


def test_what_became_dearer_and_cheaper_counts_and_noise_does_not() -> None:
    now = times(1.0)
    now["tests/unit/test_9.py"] = {"tests": 22.0}
    now["tests/unit/test_18.py"] = {"tests": 5.0}
    now["tests/unit/test_3.py"] = {"tests": 6.0}
    _, changed = growth(KNOWN, now)
    assert changed == {"tests/unit/test_9.py": pytest.approx(11.0), "tests/unit/test_18.py": pytest.approx(-15.0)}


def test_what_is_gone_counts_as_less() -> None:
    now = times(1.0)
    del now["tests/unit/test_18.py"]
    assert growth(KNOWN, now)[1] == {"tests/unit/test_18.py": -20.0}


def test_the_wall_time_is_no_cost() -> None:
    costs = {"tests": 3.0, "tower": 2.0, "wall": 100.0}
    assert sum_of(costs) == 5.0
    lines = table_of({"tests/a.py": costs, "tests/b.py": {"tests": 9.0}}, run_s=60)
    assert "14 s in 60 s: tests 12, tower 2" in lines[0]
    assert "tests/b.py" in lines[1] and "tests/a.py (100 s long" in lines[2]


@pytest.mark.parametrize(
    ("line", "kind"),
    [
        ("/x/bin/python /x/tests/worlds/program_forker.py tower-sim 27", "tower-sim"),
        ("/x/bin/python /x/bin/tower serve", "tower"),
        ("/x/bin/python /x/bin/tower-agent run", "tower-agent"),
        ("/x/bin/python -m bench towers", "bench"),
        ("/usr/lib/chromium/chromium --type=gpu-process --no-sandbox", "chromium gpu"),
        ("/usr/bin/node /x/cli.js", "node"),
        ("postgres: writer", "postgres"),
        ("nats-server -c x", "nats"),
        ("/usr/bin/git status", "other"),
        ("", "other"),
    ],
)
def test_kinds(line: str, kind: str) -> None:
    assert kind_of(line.split()) == kind


def test_chromium_writes_its_arguments_as_one() -> None:
    assert kind_of(["/usr/lib/chromium/chromium --type=renderer --lang=en"]) == "chromium renderer"
