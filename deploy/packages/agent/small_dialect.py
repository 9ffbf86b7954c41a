"""A smaller copy of pymavlink's generated dialect, for the agent's wheel.

pymavlink with all its dialects takes 93 MB on the disk, and has no wheel for 32-bit ARM. The agent needs one module of
it. This removes what only people read (docstrings, descriptions of enums, type annotations, units and display forms);
messages, constants, packing and parsing stay as they were generated. `tests/unit/deploy/test_small_dialect.py` compares
every message of both.
"""

import ast
from importlib.metadata import distribution
from importlib.util import find_spec
from pathlib import Path
from typing import Final

MODULE: Final = "pymavlink.dialects.v20.ardupilotmega"

_FOR_PEOPLE: Final = frozenset({"fielddisplays_by_name", "fieldunits_by_name"})

_ENUM_ENTRY: Final = """
__slots__ = ("name",)
description = ""
has_location = False
param = label = {}
def __init__(self, name, description):
    self.name = name
"""
"""Two thousand of them, without a dictionary each for texts that are gone."""


class _Smaller(ast.NodeTransformer):
    """Removes docstrings, annotations, and the texts of enums and fields."""

    def visit_Module(self, node: ast.Module) -> ast.Module:
        node.body = self._body(node.body)
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.ClassDef:
        if node.name == "EnumEntry":
            node.body = ast.parse(_ENUM_ENTRY).body
            return node
        node.body = self._body(node.body)
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        node.returns = None
        for argument in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs):
            argument.annotation = None
        node.body = self._body(node.body)
        return node

    def visit_Call(self, node: ast.Call) -> ast.Call:
        if isinstance(node.func, ast.Name) and node.func.id == "EnumEntry":
            node.args[1:] = [ast.Constant("")]
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt | None:
        """`x: T = v` becomes `x = v`; a declaration alone goes."""
        return None if node.value is None else ast.Assign(targets=[node.target], value=node.value)

    def _body(self, body: list[ast.stmt]) -> list[ast.stmt]:
        kept = [changed for one in body if not _is_text(one) and (changed := self.visit(one)) is not None]
        return kept or [ast.Pass()]


def _is_text(statement: ast.stmt) -> bool:
    """Whether only people read what this statement says."""
    if isinstance(statement, ast.Expr):
        return isinstance(statement.value, ast.Constant)
    if isinstance(statement, ast.AnnAssign):
        return isinstance(statement.target, ast.Name) and statement.target.id in _FOR_PEOPLE
    return isinstance(statement, ast.Assign) and any(_describes_enum(one) for one in statement.targets)


def _describes_enum(target: ast.expr) -> bool:
    """`enums["X"][1].param[2] = ...`, the same with `label`, and `enums["X"][1].has_location = ...`."""
    return (
        isinstance(target, ast.Subscript)
        and isinstance(target.value, ast.Attribute)
        and target.value.attr in {"param", "label"}
    ) or (isinstance(target, ast.Attribute) and target.attr == "has_location")


def licence() -> str:
    """Returns the text of pymavlink's licence, which goes with the copy."""
    files = distribution("pymavlink").files or ()
    return next(one for one in files if one.name == "COPYING").read_text()


def small_dialect() -> str:
    """Returns the source of the smaller module."""
    spec = find_spec(MODULE)
    assert spec is not None
    assert spec.origin is not None
    tree = _Smaller().visit(ast.parse(Path(spec.origin).read_text(encoding="utf-8")))
    return (
        f"# Made from {MODULE} of pymavlink {distribution('pymavlink').version}, without what only people read.\n"
        "# pymavlink is licensed under the LGPL 3, see LICENSE.pymavlink. Do not edit.\n"
        f"{ast.unparse(ast.fix_missing_locations(tree))}\n"
    )
