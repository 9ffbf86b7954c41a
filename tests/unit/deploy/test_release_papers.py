"""The bill of materials names what the lock files pin and the console is built from; the checksums fit."""

import hashlib
import json
import re
import subprocess
from pathlib import Path

import pytest
from packages.bill_of_materials import bill_of_materials, npm_packages, python_packages
from packages.debian import debian_version
from release import write_sums

CHECKOUT = Path(__file__).parents[3]


def test_it_lists_every_package_once_with_version_and_licence() -> None:
    bill = bill_of_materials(
        "control-tower",
        "1.2.3",
        CHECKOUT / "requirements" / "tower.txt",
        moment="2027-01-01T00:00:00+00:00",
        console=CHECKOUT / "web" / "package-lock.json",
    )
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    assert re.fullmatch(r"urn:uuid:[0-9a-f-]{36}", bill["serialNumber"])
    components = bill["components"]
    references = [one["bom-ref"] for one in components]
    assert len(references) == len(set(references))
    assert set(bill["dependencies"][0]["dependsOn"]) == set(references)
    by_name = {one["name"]: one for one in components}
    assert {"sqlalchemy", "fastapi", "cryptography", "maplibre-gl"} <= by_name.keys()
    assert "pytest" not in by_name
    assert "vite" not in by_name, "a tool of development is not in the console"
    without = [one["name"] for one in components if one["purl"].startswith("pkg:pypi") and "licenses" not in one]
    assert without == []
    json.dumps(bill)


def test_a_package_of_another_platform_is_left_out(tmp_path: Path) -> None:
    lock = tmp_path / "lock.txt"
    digest = "0" * 64
    lock.write_text(
        f"one==1.0 \\\n    --hash=sha256:{digest}\ntwo==2.0 ; sys_platform == 'win32' \\\n    --hash=sha256:{digest}\n"
    )
    assert [(one["name"], one["version"]) for one in python_packages(lock)] == [("one", "1.0")]
    assert [one["name"] for one in python_packages(lock, {"sys_platform": "win32"})] == ["one", "two"]
    assert python_packages(lock)[0]["properties"][0]["value"] == digest


def test_packages_of_the_console_have_their_hash() -> None:
    found = npm_packages(CHECKOUT / "web" / "package-lock.json")
    assert found
    assert all(re.fullmatch(r"[0-9a-f]{128}", one["hashes"][0]["content"]) for one in found)


@pytest.mark.parametrize(
    ("python", "debian"), [("1.2.3", "1.2.3"), ("1.2.3.dev0", "1.2.3~dev0"), ("1.2.3rc1", "1.2.3~rc1")]
)
def test_versions_for_debian(python: str, debian: str) -> None:
    assert debian_version(python) == debian


def test_checksums_are_those_of_the_files(tmp_path: Path) -> None:
    (tmp_path / "one.whl").write_bytes(b"content")
    write_sums(tmp_path)
    assert (tmp_path / "SHA256SUMS").read_text() == f"{hashlib.sha256(b'content').hexdigest()}  one.whl\n"
    done = subprocess.run(["sha256sum", "--check", "SHA256SUMS"], cwd=tmp_path, capture_output=True, check=False)
    assert done.returncode == 0
