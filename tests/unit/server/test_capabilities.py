"""A folder is a capability: its routes, refusals, tables and services are found, and no list names them."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Final

import pytest

import server
from server.http.part import Services
from server.runtime.capabilities import COMMON, capabilities

CHECKOUT: Final = Path(server.__file__).parents[1]

FILES: Final = {
    "__init__.py": "",
    "store/__init__.py": "",
    "core.py": """
from server.kernel.refusal import Refusal

class NoSuchNote(Refusal):
    pass

class Notes:
    def first(self) -> str:
        return "check the rotor"
""",
    "problems.py": """
from server.http.problem_kinds import Kind
from server.notes_of_a_test.core import NoSuchNote

PROBLEMS = {NoSuchNote: Kind("unknown-note", 404, "No such note")}
""",
    "store/tables.py": """
from sqlalchemy.orm import Mapped, mapped_column
from server.storage.database import Base

class NoteRow(Base):
    __tablename__ = "notes_of_a_test"
    id: Mapped[int] = mapped_column(primary_key=True)
""",
    "api.py": """
from typing import Annotated
from fastapi import APIRouter
from server.http.dependencies import provided
from server.http.problem_docs import answers
from server.notes_of_a_test.core import NoSuchNote, Notes

router = APIRouter(prefix="/api/v1")

@router.get("/notes", responses=answers(NoSuchNote))
async def first_note(notes: Annotated[Notes, provided(Notes)]) -> str:
    return notes.first()
""",
    "part.py": """
from server.http.part import Part
from server.notes_of_a_test.api import router
from server.notes_of_a_test.core import Notes

PART = Part(routers=(router,), tags={"notes": "Notes of a test."}, services=lambda common: (Notes(),))
""",
}
ASKED: Final = """
import json, sys
import server
server.__path__.append(sys.argv[1])
from server.app.routers import PARTS, ROUTERS, TAGS
from server.http.part import Services
from server.http.problem_table import PROBLEMS
from server.notes_of_a_test.core import Notes
from server.storage.tables import METADATA
print(json.dumps({
    "routes": [route.path for router in ROUTERS for route in router.routes],
    "slugs": [kind.slug for kind in PROBLEMS.values()],
    "tables": list(METADATA.tables),
    "tags": list(TAGS),
    "note": Services(one for part in PARTS if "notes" in part.tags for one in part.services(None)).of(Notes).first(),
}))
"""


def test_a_new_folder_is_all_that_a_capability_needs(tmp_path: Path) -> None:
    for name, text in FILES.items():
        file = tmp_path / "notes_of_a_test" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    answer = subprocess.run(
        [sys.executable, "-c", ASKED, str(tmp_path)], cwd=CHECKOUT, capture_output=True, text=True, check=False
    )
    assert answer.returncode == 0, answer.stderr
    found = json.loads(answer.stdout)
    assert "/api/v1/notes" in found["routes"]
    assert "/api/v1/drones" in found["routes"]
    assert "unknown-note" in found["slugs"]
    assert {"notes_of_a_test", "drones"} <= set(found["tables"])
    assert "notes" in found["tags"]
    assert found["note"] == "check the rotor"


def test_every_folder_of_the_server_is_a_capability_or_common() -> None:
    folders = {path.parent.name for path in Path(server.__file__).parent.glob("*/__init__.py")}
    assert {f"server.{name}" for name in folders - COMMON} == set(capabilities())
    assert folders >= COMMON


def test_the_order_of_the_layers_holds_in_every_capability() -> None:
    contracts = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (layers,) = [one for one in contracts if "(core)" in one.get("layers", ())]
    assert layers["containers"] == list(capabilities())


def test_a_service_that_nothing_makes_is_an_error() -> None:
    with pytest.raises(KeyError):
        Services([]).of(Path)
