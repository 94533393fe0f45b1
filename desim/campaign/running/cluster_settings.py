"""The settings of a cluster: the values of ``--cluster``, and the file that it may name.

Dask's own configuration (``jobqueue.slurm``, ``jobqueue.pbs``) holds where a setting is absent.
"""

from __future__ import annotations

import importlib.util
import re
from typing import Annotated, Literal

from pydantic import Field

from desim.errors import InputError
from desim.ports import Params
from desim.scenario import yaml12
from desim.scenario.complaints import validated
from desim.units import ByteSize, Period

_FILES = (".yaml", ".yml")
_ADDRESS = r"^(tcp|tls)://[^/\s]+:[0-9]+$"
Line = Annotated[str, Field(min_length=1)]


class Queue(Params):
    """Jobs of a batch system, with one worker process for each core."""

    kind: Literal["slurm", "pbs"] = Field(description="the batch system")
    jobs: int = Field(1, ge=1, description="how many jobs; --jobs goes before")
    queue: Line | None = Field(None, description="queue, or partition (Dask's)")
    account: Line | None = Field(None, description="who pays (Dask's)")
    cores: int | None = Field(None, ge=1, description="of a job (Dask's, or 1)")
    memory_bytes: ByteSize | None = Field(None, ge=100_000_000, examples=["2 GB"], description=(
        "of a job (Dask's, or 2 GB for each core)"))
    walltime_ns: Period | None = Field(None, examples=["4 h"], description=(
        "of a job; one that ends is replaced (Dask's, which is 30 min unless set)"))
    interface: Line | None = Field(None, examples=["ib0"], description=(
        "network between workers and the machine where desim sweep runs (Dask's)"))
    resources: Line | None = Field(None, examples=["select=1:ncpus=1:mem=2gb"], description=(
        "pbs: what stands after -l, where your PBS has words of its own (Dask's)"))
    directives: tuple[Line, ...] | None = Field(None, examples=[["--exclusive"]], description=(
        "more options of the job, as after #SBATCH or #PBS (Dask's)"))
    prologue: tuple[Line, ...] | None = Field(None, examples=[["module load python"]], description=(
        "lines of shell before the workers start (Dask's)"))
    logs: Line | None = Field(None, description="folder for what the jobs print (Dask's)")

    @property
    def where(self) -> str:
        """The place of the runs, in words."""
        return f"in {self.jobs} job{'s' * (self.jobs != 1)} of {self.kind}"


class Local(Params):
    """A Dask cluster in processes of this machine, for trying things out."""

    kind: Literal["local"]
    jobs: int | None = Field(None, ge=1, description="worker processes (one for each core)")

    @property
    def where(self) -> str:
        """The place of the runs, in words."""
        return "on a Dask cluster of this machine"


class Running(Params):
    """A Dask scheduler that somebody has started."""

    kind: Literal["dask"]
    address: str = Field(pattern=_ADDRESS, description="of the scheduler, e.g. tcp://head:8786")

    @property
    def where(self) -> str:
        """The place of the runs, in words."""
        return f"on {self.address}"


Settings = Queue | Local | Running
_KINDS: dict[str, type[Settings]] = {"local": Local, "dask": Running, "slurm": Queue,
                                      "pbs": Queue}


def load_settings(text: str, jobs: int | None = None) -> Settings:
    """The settings of ``--cluster text --jobs jobs``. Raises ``InputError``, also where Dask is not
    installed."""
    for package in ("distributed", "dask_jobqueue"):
        if importlib.util.find_spec(package) is None:
            raise InputError(f"--cluster needs {package}, which is not installed: "
                             "pip install 'desim[cluster]'")
    if re.match(_ADDRESS, text):
        return Running(kind="dask", address=text)
    given = {} if jobs is None else {"jobs": jobs}
    if text.endswith(_FILES):
        return _read(text, given)
    if text not in _KINDS or _KINDS[text] is Running:
        raise InputError(f"--cluster {text}: must be local, slurm, pbs, the address of a Dask "
                         "scheduler (tcp://host:port), or a YAML file")
    return _KINDS[text].model_validate({"kind": text, **given})


def _read(file: str, given: dict[str, int]) -> Settings:
    data, places = yaml12.read(file)
    kind = data.get("kind")
    if kind not in _KINDS:
        place = places.value(() if kind is None else ("kind",))
        wrong = "is missing" if kind is None else f"{kind!r} is not allowed"
        raise InputError(f"{place}: kind: {wrong}; allowed: {', '.join(_KINDS)}")
    settings = validated(_KINDS[kind], data)
    if isinstance(settings, list):
        raise InputError(*dict.fromkeys(complaint.line(places) for complaint in settings))
    return settings if kind == "dask" else settings.model_copy(update=given)
