"""Pages of the documentation site that are not files in docs/: the reference made from the code, and the root's papers.

MkDocs loads this as a hook. It starts no server and opens no database.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import typer.main
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from onboard_agent import VERSION as AGENT_VERSION
from onboard_agent.command_line import command_line
from server.app.cli import app as tower_app
from server.app.composition import create_app
from server.runtime.settings import Settings
from simulator.cli import app as simulator_app
from simulator.firmware.command_line import app as flight_controller_app

ROOT: Final = Path(__file__).resolve().parent.parent
PAPERS: Final = {"security.md": "SECURITY.md", "contributing.md": "CONTRIBUTING.md", "changelog.md": "CHANGELOG.md"}
"""Pages of the site by files in the root."""

_COMMANDS: Final = {"tower": (tower_app,), "tower-sim": (simulator_app, flight_controller_app)}
_METHODS: Final = ("get", "put", "post", "patch", "delete")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages."""
    pages = {"reference/commands.md": commands_page(), "reference/rest.md": rest_page(create_app(Settings()).openapi())}
    pages |= {page: from_root((ROOT / paper).read_text()) for page, paper in PAPERS.items()}
    for path, text in pages.items():
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Links to papers of the root lead to their pages; links to what is not part of the site become plain text."""
    up = "../" * page.file.src_uri.count("/")
    for name, paper in PAPERS.items():
        markdown = markdown.replace(f"]({up}../{paper}", f"]({up}{name}")
    return re.sub(r"\[([^\]]+)\]\((?:LICENSE|(?:docs/)?(?:adr|screenshots)/?)\)", r"\1", markdown)


def from_root(text: str) -> str:
    """A paper of the root, with its links as seen from docs/."""
    for name, paper in PAPERS.items():
        text = text.replace(f"]({paper}", f"]({name}")
    return text.replace("](docs/", "](")


def commands_page() -> str:
    """Every command and option, as `--help` says it."""
    lines = ["# Commands", "", "Made from the code: what `--help` prints.", ""]
    for program, apps in _COMMANDS.items():
        commands = [typer.main.get_command(app) for app in apps]
        lines += [f"## {program}", "", commands[0].help or "", ""]
        for path, command in (leaf for one in commands for leaf in _leaves(one, (program,))):
            lines += _command_lines(path, command)
    return "\n".join([*lines, *_agent_lines()])


def _agent_lines() -> Iterator[str]:
    """The commands of the agent, whose command line is argparse's."""
    parser = command_line(AGENT_VERSION)
    yield from ("## tower-agent", "", parser.description or "", "")
    commands = next(one for one in parser._actions if isinstance(one, argparse._SubParsersAction))
    for name, command in commands.choices.items():
        arguments = [one for one in command._actions if not one.option_strings]
        usage = " ".join(["tower-agent", name, *(str(one.metavar) for one in arguments)])
        yield from (f"### tower-agent {name}", "", f"`{usage}`", "", command.description or "", "")
        yield from ("| option | meaning |", "|---|---|")
        for one in command._actions:
            if one.option_strings and one.dest != "help":
                yield f"| `{'`, `'.join(one.option_strings)}` | {_plain((one.help or '').replace('%%', '%'))} |"
        yield ""


def _leaves(command: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    subcommands = getattr(command, "commands", None)
    if subcommands is None:
        yield path, command
        return
    for name, one in sorted(subcommands.items()):
        yield from _leaves(one, (*path, name))


def _command_lines(path: tuple[str, ...], command: Any) -> list[str]:
    arguments = [one for one in command.params if one.param_type_name == "argument"]
    options = [one for one in command.params if one.param_type_name == "option" and not one.hidden]
    usage = " ".join([*path, *(one.metavar or one.name.upper() for one in arguments)])
    lines = [f"### {' '.join(path)}", "", f"`{usage}`", "", _plain(command.help or ""), ""]
    if options:
        lines += ["| option | variable | default | meaning |", "|---|---|---|---|"]
        for one in options:
            names = ", ".join(f"`{name}`" for name in (*one.opts, *one.secondary_opts))
            variables = one.envvar if isinstance(one.envvar, list | tuple) else [one.envvar] if one.envvar else []
            default = "" if one.default in (None, (), [], False) or one.is_flag else f"`{one.default}`"
            named = ", ".join(f"`{name}`" for name in variables)
            lines.append(f"| {names} | {named} | {default} | {_plain(one.help or '')} |")
        lines.append("")
    return lines


def rest_page(document: dict[str, Any]) -> str:
    """Every operation with its summary and the statuses of its answers."""
    made = "Made from the OpenAPI document, which the tower serves at `/api/v1/openapi.json`. It has the schemas."
    lines = ["# REST operations", "", made, ""]
    by_tag: dict[str, list[str]] = {}
    for path, methods in sorted(document["paths"].items()):
        for method in (one for one in _METHODS if one in methods):
            operation = methods[method]
            row = f"| `{method.upper()}` | `{path}` | {_plain(operation.get('summary', ''))} | {_statuses(operation)} |"
            by_tag.setdefault((operation.get("tags") or ["other"])[0], []).append(row)
    for tag, rows in sorted(by_tag.items()):
        lines += [f"## {tag}", "", "| method | path | purpose | answers |", "|---|---|---|---|", *rows, ""]
    return "\n".join(lines)


def _statuses(operation: dict[str, Any]) -> str:
    return ", ".join(sorted(operation["responses"]))


def _plain(text: str) -> str:
    """One line that a table can hold."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
