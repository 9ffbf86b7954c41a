"""Finds the texts that the tower and its agents make and the console shows, for their translations.

python web/scripts/tower_texts.py            brings web/src/languages/*/tower/*.json up to date: adds new texts with an
                                             empty translation, drops those that no source has, keeps the rest
python web/scripts/tower_texts.py --check    fails where a file lacks a text or has one that no source has

A text is a literal that reads like words for people. A value in it becomes `{name}`, a number `{name:number}`, and a
value that is itself a text of the catalogue `{name:text}`. tower_text.ts finds a text by these keys.
"""

import ast
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).resolve().parent))

from tower_text_rules import AREAS, MACHINE_CALLS, MACHINE_KEYWORDS, MORE, NO_TEXTS, NOT_SHOWN, TEXT_VALUES

CHECKOUT: Final = Path(__file__).resolve().parents[2]
LANGUAGES: Final = ("pt",)
MAX_ALTERNATIVES: Final = 16
_PROSE: Final = re.compile(
    r"[A-Za-z]{2,}[,:;.)”\"]* +[A-Za-z{(]|\} [(a-z]{2}|[a-z]{2}[:,]? \{|\b[a-z]{2,}[.:,] ?$|: \{"
)
_WORD: Final = re.compile(r"[A-Za-z][A-Za-z' -]+[a-z]|[A-Z][a-z]+")
_NUMBER: Final = re.compile(r",?(\.\d+)?[fgd%]|,|\+?\d*d|0\d+d?")
_NUMERIC: Final = re.compile(
    r"count|number|items?|limit|total|missing|refused|seconds|code|status|(max|min)_.*", re.IGNORECASE
)
_BRACES: Final = re.compile(r"\{(\w*)\}")

Alternatives = list[str]


def is_text_name(name: str) -> bool:
    """Whether the value of a variable or call of this name is a text itself."""
    return name in TEXT_VALUES or name.endswith("words")


def _name_of(node: ast.expr) -> str:
    """The last name in an expression: `facts.name` is `name`."""
    match node:
        case ast.Name():
            return node.id.strip("_").lower()
        case ast.Attribute():
            return node.attr.strip("_").lower()
        case ast.Call(func=ast.Attribute(attr="join"), args=[joined]):
            return _name_of(joined)
        case ast.Call(func=ast.Attribute(attr="get" | "replace" | "rstrip" | "strip" | "upper", value=changed)):
            return _name_of(changed)
        case ast.Call(func=ast.Name(id="len" | "round" | "str" | "max" | "min" | "abs" | "next"), args=[first, *_]):
            return _name_of(first)
        case ast.Call():
            return _name_of(node.func)
        case ast.Subscript() | ast.Starred():
            return _name_of(node.value)
        case ast.BinOp() if not isinstance(node.left, ast.Constant):
            return _name_of(node.left)
        case ast.BinOp():
            return _name_of(node.right)
        case ast.BoolOp():
            return _name_of(node.values[0])
        case ast.IfExp():
            return _name_of(node.body)
        case ast.UnaryOp():
            return _name_of(node.operand)
        case ast.GeneratorExp() | ast.ListComp():
            return _name_of(node.elt)
        case _:
            return "value"


def _is_number(node: ast.expr, name: str) -> bool:
    if isinstance(node, ast.BinOp):
        return not isinstance(node.op, ast.Add) or isinstance(node.right, ast.Constant)
    if (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in {"len", "round", "abs", "max"}
    ):
        return True
    return _NUMERIC.fullmatch(name) is not None


def _is_choice(value: ast.expr) -> bool:
    """Whether it is one of two literals."""
    return isinstance(value, ast.IfExp) and all(_written(one) is not None for one in (value.body, value.orelse))


def _hole(node: ast.FormattedValue) -> Alternatives:
    """What stands for a value, or the words of both branches of a choice."""
    value = node.value
    if isinstance(value, ast.IfExp) and _is_choice(value):
        return [text for one in (value.body, value.orelse) for text in _written(one) or []]
    name = _name_of(value)
    spec = "" if node.format_spec is None else ast.unparse(node.format_spec)[2:-1]
    if (spec and _NUMBER.fullmatch(spec)) or (not spec and _is_number(value, name)):
        return [f"{{{name}:number}}"]
    return [f"{{{name}:text}}" if is_text_name(name) and not spec else f"{{{name}}}"]


def _product(parts: list[Alternatives]) -> Alternatives:
    texts = [""]
    for part in parts:
        texts = [text + one for text in texts for one in part][:MAX_ALTERNATIVES]
    return texts


def _hole_of_template(hole: re.Match[str]) -> str:
    """The same for a literal that `format` fills in."""
    if not hole[1]:
        return "{who:text}"
    return f"{{{hole[1]}:number}}" if _NUMERIC.fullmatch(hole[1]) else hole[0]


def _written(node: ast.expr) -> Alternatives | None:
    """The texts that an expression writes; None: it is no literal."""
    match node:
        case ast.Constant(value=str() as text):
            return [_BRACES.sub(_hole_of_template, text)]
        case ast.JoinedStr():
            return _product(
                [_hole(one) if isinstance(one, ast.FormattedValue) else _written(one) or [""] for one in node.values]
            )
        case ast.BinOp(op=ast.Add()):
            sides = [_written(node.left), _written(node.right)]
            if all(one is None for one in sides):
                return None
            pairs = zip(sides, (node.left, node.right), strict=True)
            return _product([side if side is not None else _hole(ast.FormattedValue(one, -1)) for side, one in pairs])
        case _:
            return None


def _callee(node: ast.Call) -> str:
    return ast.unparse(node.func)


class _Finder(ast.NodeVisitor):
    """Collects the texts of one file. In some places a single word is a text, too."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._is_place = False

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, ast.expr):
            texts = _written(node)
            if texts is not None:
                self.texts += [one for one in texts if _is_text(one, is_place=self._is_place)]
                self._visit_values(node)
                return
        super().visit(node)

    def _visit_values(self, node: ast.expr) -> None:
        """Texts within the values of a text. The words of a choice are in the text already."""
        for part in ast.walk(node):
            if isinstance(part, ast.FormattedValue) and not _is_choice(part.value):
                self._at(part.value, is_place=True)

    def _at(self, node: ast.AST | None, *, is_place: bool) -> None:
        before, self._is_place = self._is_place, is_place
        if node is not None:
            self.visit(node)
        self._is_place = before

    def visit_Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):
            self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        if MACHINE_CALLS.search(_callee(node)):
            return
        for part in node.args:
            self._at(part, is_place=False)
        for keyword in node.keywords:
            if keyword.arg not in MACHINE_KEYWORDS:
                self._at(keyword.value, is_place=is_text_name(keyword.arg or ""))
        self.visit(node.func)

    def visit_Compare(self, node: ast.Compare) -> None:
        """Strings that are compared are for machines."""
        self._at(node.left, is_place=False) if not isinstance(node.left, ast.Constant) else None

    def visit_Subscript(self, node: ast.Subscript) -> None:
        self._at(node.value, is_place=self._is_place)

    def visit_Assign(self, node: ast.Assign) -> None:
        named = any(is_text_name(_name_of(one)) for one in node.targets if isinstance(one, ast.Name | ast.Attribute))
        self._at(node.value, is_place=named)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        self._at(node.value, is_place=is_text_name(_name_of(node.target)))

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._at(node.test, is_place=False)
        self.visit(node.body)
        self.visit(node.orelse)

    def visit_Dict(self, node: ast.Dict) -> None:
        for value in node.values:
            self.visit(value)

    def visit_Return(self, node: ast.Return) -> None:
        self._at(node.value, is_place=self._is_place)

    def _visit_function(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        for part in [*node.args.defaults, *node.args.kw_defaults]:
            self._at(part, is_place=False)
        for decorator in node.decorator_list:
            self.visit(decorator)
        for statement in node.body:
            self._at(statement, is_place=is_text_name(node.name.strip("_")) and isinstance(statement, ast.Return))

    visit_FunctionDef = _visit_function
    visit_AsyncFunctionDef = _visit_function


def _is_text(text: str, *, is_place: bool) -> bool:
    plain = re.sub(r"\{[^}]*\}", "{}", text).strip()
    if not re.search(r"[A-Za-z]{2}", plain) or NO_TEXTS.search(plain):
        return False
    return _PROSE.search(text) is not None or (is_place and _WORD.fullmatch(plain.strip(" ,.:;(){}")) is not None)


def numbered(text: str) -> str:
    """The same with different names for different values."""
    seen: dict[str, int] = {}

    def name(hole: re.Match[str]) -> str:
        seen[hole[1]] = seen.get(hole[1], 0) + 1
        return f"{{{hole[1]}{seen[hole[1]] if seen[hole[1]] > 1 else ''}{hole[2] or ''}}}"

    return re.sub(r"\{(\w+)(:\w+)?\}", name, text)


def texts_of(source: str) -> list[str]:
    """The keys of all texts in a file."""
    finder = _Finder()
    finder.visit(ast.parse(source))
    return [numbered(one.strip("\n")) for one in finder.texts]


def _sources() -> Iterator[tuple[str, str]]:
    for folder in ("onboard_agent", "server", "wire"):
        for path in sorted((CHECKOUT / folder).rglob("*.py")):
            place = path.relative_to(CHECKOUT).as_posix()
            if not NOT_SHOWN.match(place):
                yield place, path.read_text()


def collected() -> dict[str, str]:
    """Every text with its area: the first one that uses it."""
    order = [area for area, _ in AREAS]
    found: dict[str, str] = {}
    for place, source in _sources():
        area = next(area for area, pattern in AREAS if re.match(pattern, place))
        for text in [*texts_of(source), *MORE.get(place, ())]:
            found[text] = min(found.get(text, area), area, key=order.index)
    return found


def _read(language: str) -> dict[str, str]:
    folder = CHECKOUT / "web" / "src" / "languages" / language / "tower"
    files = [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]
    return {text: words for file in files for text, words in file.items()}


def _files(language: str) -> Iterator[tuple[Path, str]]:
    """The files of a language as they should be."""
    known, texts = _read(language), collected()
    for area, _ in AREAS:
        mine = {text: known.get(text, "") for text in sorted(texts) if texts[text] == area}
        path = CHECKOUT / "web" / "src" / "languages" / language / "tower" / f"{area}.json"
        yield path, json.dumps(mine, ensure_ascii=False, indent=2) + "\n"


def main() -> int:
    stale = [
        (path, wanted)
        for language in LANGUAGES
        for path, wanted in _files(language)
        if not path.exists() or path.read_text() != wanted
    ]
    for path, wanted in stale:
        print(path.relative_to(CHECKOUT))
        if "--check" not in sys.argv:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(wanted)
    return 1 if stale and "--check" in sys.argv else 0


if __name__ == "__main__":
    sys.exit(main())
