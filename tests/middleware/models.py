"""The middlewares that the kit and the walk try, with the time that each of them may take."""

from typing import Any, NamedTuple

from toys import Late, Naive

from desim.middleware.dds.plugin import Dds
from desim.middleware.direct import Direct
from desim.testing import Patience
from desim.testing.fleet import HOSTS

S = 10**9

ANY = Patience(stops=(0, 1, 2, 3))


class Model(NamedTuple):
    """``patience.stops``: which hosts may stop for a while."""

    cls: type
    patience: Patience = ANY
    params: dict[str, Any] = {}  # noqa: RUF012 - nobody changes it

    def make(self) -> Any:
        return self.cls(self.cls.Params(**self.params))


_SERVED = {"discovery": "server", "server": HOSTS[0]}

MODELS = {
    "direct": Model(Direct),
    "late": Model(Late),
    "naive": Model(Naive),
    "fastdds": Model(Dds, params={"preset": "fastdds"}),
    "fastdds, served": Model(Dds, params={"preset": "fastdds", **_SERVED}),
    "cyclonedds": Model(Dds, params={"preset": "cyclonedds"}),
    "cyclonedds, served": Model(Dds, params={"preset": "cyclonedds", **_SERVED}),
}
