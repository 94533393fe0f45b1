"""The reference of the commands, from the functions that they are."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from typing import get_args, get_type_hints

from typer.models import ArgumentInfo, OptionInfo

from desim.cli import app
from site_pages.text import code, inline, prose, table


def page() -> str:
    """A section for each command."""
    parts = ["# Options of the commands", inline(str(app.info.epilog)),
             "[Commands](../docs/commands.md) says which page explains what."]
    for command in app.registered_commands:
        function = command.callback
        assert function is not None
        rows = list(_rows(function))
        names = " ".join(name for name, is_option, *_ in rows if not is_option)
        parts += [f"## desim {command.name}", prose(inspect.getdoc(function) or ""),
                  f"```text\ndesim {command.name} {names} [options]\n```"]
        if rows:
            parts.append(table(("", "", "default"), [
                (code(name), inline(about), code(default)) for name, _, about, default in rows]))
    return "\n\n".join(parts) + "\n"


def _rows(function: Callable[..., object]) -> Iterator[tuple[str, bool, str, str]]:
    """Each parameter: how it is written, whether it is an option, what it is, its default."""
    kinds = get_type_hints(function, vars(inspect.getmodule(function)), include_extras=True)
    for name, parameter in inspect.signature(function).parameters.items():
        info = next((one for one in get_args(kinds[name]) if isinstance(
            one, ArgumentInfo | OptionInfo)), None)
        if info is None:  # typer's own context
            continue
        is_option = isinstance(info, OptionInfo)
        kind, *_ = get_args(kinds[name])
        metavar = info.metavar or ("" if kind is bool else name.upper())
        # In an annotation typer takes an option's first name for its default.
        names = [one for one in (info.default, *(info.param_decls or ())) if isinstance(one, str)]
        written = " ".join(filter(None, (", ".join(names or [f"--{name.replace('_', '-')}"]),
                                         metavar))) if is_option else metavar
        required = parameter.default is inspect.Parameter.empty
        default = "" if required or parameter.default in (None, False) or \
            parameter.default == [] else str(parameter.default)
        yield written, is_option, info.help or "", default
