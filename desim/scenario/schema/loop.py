"""The real programs of a scenario: what ``desim loop`` starts, and on which hosts."""

from __future__ import annotations

from pydantic import Field

from desim.ports import Params
from desim.units import Duration


class Program(Params):
    """A real program on one host, which then runs nothing of desim."""

    host: str = Field(description="a robot, or one of hosts")
    run: str = Field(description=(
        "the command line, for /bin/sh; $DESIM_HOST and $DESIM_IP are its host's name and address, "
        "$DESIM_PYTHON the interpreter that runs desim"))
    at_ns: Duration = Field("0 s", description="when it starts")
    env: dict[str, str] = Field({}, description="environment variables, beside desim's")
    folder: str = Field(".", description=(
        "where it starts: a path, relative to the scenario that names it"))


class Loop(Params):
    """Real programs whose packets go over the networks of the scenario."""

    programs: tuple[Program, ...] = Field((), description="in the order in which they are started")
    ros_master: str | None = Field(None, description=(
        "the host of the ROS 1 master, which all programs get as ROS_MASTER_URI (null: none)"))
    dds_domain: int | None = Field(None, ge=0, le=232, description=(
        "the DDS domain in which robots with programs have topics of ROS 2, and which all programs "
        "get as ROS_DOMAIN_ID (null: no such topics)"))
    navigation: bool = Field(False, description=(
        "whether robots with programs run desim's localization, mapping, map exchange and "
        "navigation, for programs that read the map and send goals"))

    @property
    def hosts(self) -> frozenset[str]:
        """The hosts that run real programs."""
        return frozenset(program.host for program in self.programs)
