"""The middlewares that the kit and the walk try, with the time that each of them may take."""

from typing import Any, NamedTuple

from toy_middlewares import Late, Naive

from desim.middleware.dds.dds import Dds
from desim.middleware.direct import Direct
from desim.middleware.multimaster.multimaster import Multimaster
from desim.middleware.ros1.ros1 import Ros1
from desim.middleware.zenoh.zenoh import Zenoh
from desim.testing import Patience
from desim.testing.fleet import HOSTS

S = 10**9

# Nothing sleeps for longer than it was out of reach, which is a minute at most.
ANY = Patience(stops=(0, 1, 2, 3), again_ns=75 * S)


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
    # A master that has stopped knows nobody afterwards, and nobody tells it anew.
    "ros1": Model(Ros1, ANY._replace(stops=(1, 2, 3)), {"master": HOSTS[0]}),
    "rospy": Model(Ros1, ANY._replace(stops=(1, 2, 3)), {"master": HOSTS[0], "client": "rospy"}),
    "fkie_1_3_groovy": Model(Multimaster, params={"preset": "fkie_1_3_groovy"}),
    "fkie_1_3": Model(Multimaster, params={"preset": "fkie_1_3"}),
    "fastdds": Model(Dds, params={"preset": "fastdds"}),
    "fastdds, served": Model(Dds, params={"preset": "fastdds", **_SERVED}),
    "cyclonedds": Model(Dds, params={"preset": "cyclonedds"}),
    "cyclonedds, served": Model(Dds, params={"preset": "cyclonedds", **_SERVED}),
    "zenoh": Model(Zenoh),
    "zenoh, peers": Model(Zenoh, params={"mode": "peer"}),
    "zenoh, star": Model(Zenoh, ANY._replace(stops=(1, 2, 3)),
                         {"discovery": "connect", "connect": [HOSTS[0]]}),
}
