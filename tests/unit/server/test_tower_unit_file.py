"""deploy/tower.service: its priority is the one that `bench anonymous` uses, and its sandboxing is in place."""

from pathlib import Path

import pytest

from bench.as_installed import nice_of

UNIT = Path(__file__).parents[3] / "deploy" / "tower.service"


@pytest.fixture
def service() -> dict[str, str]:
    lines = UNIT.read_text().partition("[Service]")[2].partition("[Install]")[0].splitlines()
    return dict(line.split("=", 1) for line in lines if "=" in line and not line.startswith("#"))


def test_frames_go_before_other_programs_as_in_the_benchmark(service: dict[str, str]) -> None:
    assert int(service["Nice"]) == nice_of("tower.service") < 0
    assert "setpriority" in UNIT.read_text(), "or the process that hashes passwords could not step back"


def test_a_unit_without_a_priority_is_no_measure() -> None:
    with pytest.raises(FileNotFoundError):
        nice_of("nothing.service")


@pytest.mark.parametrize("name", ["DynamicUser", "NoNewPrivileges", "ProtectHome", "PrivateDevices"])
def test_it_is_locked_in(service: dict[str, str], name: str) -> None:
    assert service[name] == "yes"
