"""The commands that write and read the formats of other tools."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from desim.commands.arguments import RunPath, Trust
from desim.commands.compiling import compiling
from desim.commands.exit_codes import exit_codes, reading
from desim.commands.output import say
from desim.errors import extra

if TYPE_CHECKING:
    from desim.results.recording import Recording


def export(path: RunPath,
           mcap: Annotated[Path | None, typer.Option(
               metavar="FILE", help="a recording for Foxglove and ROS 2, and a layout for Foxglove "
                                    "beside it", show_default=False)] = None,
           bag: Annotated[Path | None, typer.Option(
               metavar="FILE", help="a recording for ROS 1", show_default=False)] = None,
           csv: Annotated[Path | None, typer.Option(
               metavar="FOLDER", help="all tables, as CSV files", show_default=False)] = None,
           graphml: Annotated[Path | None, typer.Option(
               metavar="FILE", help="the network over time", show_default=False)] = None,
           animation: Annotated[Path | None, typer.Option(
               metavar="FILE", help="an animation for slides, .gif or .apng",
               show_default=False)] = None,
           pcap: Annotated[Path | None, typer.Option(
               metavar="FILE", help="the packets of a medium, for Wireshark; the run is repeated",
               show_default=False)] = None,
           medium: Annotated[str | None, typer.Option(
               help="the medium of --pcap (default: the only one)", show_default=False)] = None,
           trust: Trust = False) -> None:
    """A run in the formats of other tools."""
    with reading(trust):
        from desim.errors import InputError

        if medium is not None and pcap is None:
            raise InputError("--medium: it belongs to --pcap")
        if not (mcap or bag or csv or graphml or animation or pcap):
            raise InputError("nothing to export; allowed: --mcap, --bag, --csv, --graphml, "
                             "--animation, --pcap")
        _refuse_one_file_twice({"--mcap": mcap, "--bag": bag, "--csv": csv, "--graphml": graphml,
                                "--animation": animation, "--pcap": pcap})
        with compiling(False):
            from desim.api import recording_of
            from desim.results.run import Run
        run = Run(path, trust)
        if csv is not None:
            from desim.export.csv_tables import write_csv

            with _counting("tables") as done:
                written = write_csv(run, csv, done)
            say("\n".join(map(str, written)))
        if mcap or bag or graphml or animation:
            _export_recording(recording_of(run), mcap, bag, graphml, animation)
        if pcap is not None:
            from desim.export.pcap.capture import write_pcap
            from desim.results.status import refuse_imported

            refuse_imported(run.path, run.manifest, "packets")
            with _counting("packets") as done:
                count = write_pcap(run, medium or _only_medium(run.scenario.network.media), pcap,
                                   done)
            say(f"{pcap}: {count} packets")


def _refuse_one_file_twice(targets: Mapping[str, Path | None]) -> None:
    from desim.errors import InputError

    options: dict[Path, str] = {}
    for option, path in targets.items():
        if path is not None:
            first = options.setdefault(path.resolve(), option)
            if first != option:
                raise InputError(f"{option}: {path} is the file of {first}, too")


def _export_recording(recording: Recording, mcap: Path | None, bag: Path | None,
                      graphml: Path | None, animation: Path | None) -> None:
    if mcap or bag:
        _export_ros(recording, mcap, bag)
    if graphml is not None:
        from desim.export.graphml import write_graphml

        graph = write_graphml(recording, graphml)
        say(f"{graphml}: {len(graph)} hosts, {graph.number_of_edges()} edges")
    if animation is not None:
        from desim.export.animation.animation_file import write_animation

        with _counting("pictures") as done:
            count = write_animation(recording, animation, done)
        say(f"{animation}: {count} pictures")


def _export_ros(recording: Recording, mcap: Path | None, bag: Path | None) -> None:
    with extra("recordings", "--mcap" if mcap is not None else "--bag"):
        from desim.export.ros.recording_files import FOXGLOVE, RVIZ_1, RVIZ_2, write_bag, write_mcap
    for path, write, beside in (
            (mcap, write_mcap, ((FOXGLOVE, "a layout to import into Foxglove"),
                                (RVIZ_2, "rviz2 -d shows all topics with it"))),
            (bag, write_bag, ((RVIZ_1, "rviz -d shows all topics with it"),))):
        if path is not None:
            with _counting("messages") as done:
                counts = write(recording, path, done)
            say(f"{path}: {sum(counts.values())} messages on {len(counts)} topics")
            for ending, what in beside:
                say(f"{path.with_suffix(ending)}: {what}")


def import_(paths: Annotated[list[Path], typer.Argument(
                metavar="FILE...", show_default=False, help=(
                    "an MCAP file, a bag of ROS 1, the folder of a bag of ROS 2, a .db3 of it, or "
                    "TUM trajectories, a robot each"))],
            out: Annotated[Path, typer.Option(help="folder for results")] = Path("results"),
            name: Annotated[str | None, typer.Option(
                help="the run's name (default: the file's)", show_default=False)] = None,
            topic: Annotated[str | None, typer.Option(
                metavar="PATTERN", help="take poses from these topics only, e.g. '/*/odom'",
                show_default=False)] = None) -> None:
    """A recording of real robots as a run: to look at it, and to compare it with others."""
    with exit_codes():
        with extra("recordings", "import"):
            from desim.imports.imported_run import import_recording

        done = import_recording(paths[0], out, name, topic, paths[1:])
        say("\n".join([*done.notes, f"results in {done.run.path}"]))


def _only_medium(media: Mapping[str, object]) -> str:
    from desim.errors import InputError

    if len(media) != 1:
        raise InputError(f"--pcap: --medium NAME is missing; allowed: {', '.join(media)}")
    return next(iter(media))


def _counting(what: str) -> AbstractContextManager[Callable[[int, int], None]]:
    """A bar for a long export, beside what is printed about it."""
    from desim.commands.views.bars import counting
    from desim.commands.views.terminal import Terminal

    return counting(Terminal(stderr=True), what)
