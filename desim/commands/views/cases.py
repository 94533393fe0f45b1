"""Network cases: their list, their options and their measures."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, get_args, get_origin

from rich.table import Table
from rich.text import Text

from desim import plugins
from desim.commands.options import descriptions
from desim.commands.views.catalogue import first_sentence
from desim.ports import Params
from desim.ports.cases import ShowsSettings
from desim.units import rate_text

Measures = Mapping[str, Any]  # of desim.netcases.case.play
FLEET = "fleet"  # not a plug-in: it plays a scenario
LAYOUT = "layout"  # its parameters, lists of places and flows, stand in a file


def overview() -> str:
    """The usage of ``desim net``, and the list of cases."""
    points = plugins.available("case")
    width = max(map(len, (*points, FLEET)))
    return "\n".join([
        "Usage: desim net CASE [--key value ...] [--seed N] [--json]", "",
        "Play a standard network case without robots. Cases:",
        *(f"  {case:<{width}}  {first_sentence('case', case)}" for case in points), "",
        "or what robots say, without the robots:",
        f"  {FLEET:<{width}}  Whether a scenario's network carries what its robots say", "",
        "desim net CASE --help shows the options of one."])


def usage(case: str) -> str:
    """The description of a case, and its options. Raises ``InputError`` for an unknown case."""
    if case == FLEET:
        from desim.netcases.fleet_load import FleetLoad

        return _usage(f"{FLEET} SCENARIO", FleetLoad, FleetLoad, "the scenario's")
    block, cls = plugins.parameters("case", case), plugins.load("case", case)
    return _layout_usage(block, cls) if case == LAYOUT else _usage(case, block, cls, "1")


def _layout_usage(block: type[Params], about: type) -> str:
    own, radio = ([*_keys(block, chosen)] for chosen in _own_and_other(block))
    width = max(len(key) for key, _ in own + radio)
    return "\n".join([f"Usage: desim net {LAYOUT} FILE [--seed N] [--json]", "",
                      inspect.getdoc(about) or "", "",
                      "The keys of the file, which is YAML:", "",
                      *(f"  {key:<{width}}  {description}" for key, description in own), "",
                      "and those of the radio (desim describe radio has the keys inside):", "",
                      *(f"  {key:<{width}}  {description}" for key, description in radio), "",
                      "  --seed N  of all random numbers; default 1",
                      "  --json    one JSON object"])


def _own_and_other(block: type[Params]) -> tuple[list[str], list[str]]:
    """The fields that a block declares itself, and those that it inherits."""
    own = [name for name in block.model_fields if name in block.__annotations__]
    return own, [name for name in block.model_fields if name not in own]


def _keys(block: type[Params], chosen: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Each ``chosen`` field of a file with its description; the keys of a block, or of a list or
    mapping of blocks, stand below it if they are of the file's own."""
    for name in chosen:
        info = block.model_fields[name]
        plain = info.is_required() or isinstance(info.default, Params) or info.default in (
            None, (), {})
        key = info.alias or name
        yield key, f"{info.description}" + ("" if plain else f"; default {_word(info.default)}")
        inside, lead = _inside(info.annotation)
        if name in block.__annotations__ and inside is not None:
            for below, about in _keys(inside, inside.model_fields):
                yield f"{key}{lead}.{below}", about


def _inside(annotation: object) -> tuple[type[Params] | None, str]:
    """The block that a field has, and what stands between its key and those of the block."""
    between = ".HOST" if get_origin(annotation) is dict else "[]"
    for shape, lead in ((annotation, ""), *((one, between) for one in get_args(annotation))):
        if isinstance(shape, type) and issubclass(shape, Params):
            return shape, lead
    return None, ""


def _usage(words: str, block: type[Params], about: type, seed: str) -> str:
    options = [*descriptions(block), ("--seed N", f"of all random numbers; default {seed}"),
               ("--json", "one JSON object")]
    width = max(len(option) for option, _ in options)
    return "\n".join([f"Usage: desim net {words} [--key value ...] [--seed N] [--json]", "",
                      inspect.getdoc(about) or "", "",
                      *(f"  {option:<{width}}  {about}" for option, about in options), "",
                      "A number without a unit has the one that is shown."])


def title(case: str, seed: int, params: Params) -> str:
    """A line about the case that was played, with its options; of a layout, the numbers of its
    hosts and flows, and what the radio is given."""
    settings = params.model_dump(mode="json", by_alias=True)
    if case == LAYOUT:
        _, radio = _own_and_other(type(params))
        unsaid = {type(params).model_fields[name].alias or name
                  for name in radio if name not in params.model_fields_set}
        settings = {"hosts": len(settings.pop("places")), "flows": len(settings.pop("flows")),
                    **{key: value for key, value in settings.items()
                       if key not in unsaid and not isinstance(value, (dict, list))}}
    if isinstance(params, ShowsSettings):
        settings |= params.shown()
    given = (f"{key} {_word(value)}" for key, value in settings.items() if value is not None)
    return f"{case}: {', '.join((*given, f'seed {seed}'))}"


def _word(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def measures_table(measures: Measures) -> Table:
    """The measures of ``desim.netcases.case.play`` as a table."""
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="cyan", no_wrap=True)
    table.add_column(no_wrap=True, justify="right")
    table.add_column(style="dim")
    for row in _rows(measures):
        table.add_row(*map(Text, row))
    return table


def _rows(m: Measures) -> Iterator[tuple[str, str, str]]:
    offered = m["offered_mbps"]
    yield ("goodput", rate_text(1e6 * m["goodput_mbps"], 3),
           "of payload" + ("" if offered is None else f"; offered {rate_text(1e6 * offered, 3)}"))
    if m["goodput_share"] is not None:
        yield "", f"{m['goodput_share']:.4f}", "of what it is compared with (goodput_share)"
    yield "throughput", rate_text(1e6 * m["throughput_mbps"], 3), "with headers"
    if m["delay_mean_ms"] is not None:
        error = m["delay_error_ms"]
        yield ("delay", f"{m['delay_mean_ms']:.3f} ms",
               "mean" + ("" if error is None else f", standard error {error:.3f} ms"))
        for share in (50, 95, 99):
            yield "", f"{m[f'delay_p{share}_ms']:.3f} ms", f"{share} % arrive within"
    yield "delivered", str(m["delivered"]), _share(m["delivery_ratio"], "of what was settled")
    for reason, count in m["lost"].items():
        yield "lost", str(count), reason
    if m["attempts"] is not None:
        yield "attempts", str(m["attempts"]), _share(m["failure_rate"], "failed (failure_rate)")
    if m["control_frames"] is not None:
        yield "control", f"{m['control_bytes']} B", f"in {m['control_frames']} frames of protocols"
    if m["utilisation"] is not None:
        yield ("utilisation", f"{m['utilisation']['mean']:.4f}",
               f"mean over hosts, ports or cables; the largest {m['utilisation']['max']:.4f}")
    if m["drop_rate"] is not None:
        yield "drop rate", f"{m['drop_rate']:.5f}", "given up, of those that were not refused"
    if m["fairness"] is not None:
        yield "fairness", f"{m['fairness']:.4f}", "Jain's index of the flows"
    yield "measured", f"{m['measured_s']:.3f} s", "simulated, without the warm-up"


def _share(value: float | None, of: str) -> str:
    return "" if value is None else f"{value:.4f} {of}"
