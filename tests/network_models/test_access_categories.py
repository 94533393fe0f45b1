"""Stations of two access categories on one air, against ns-3."""

import pytest
from stations import Flow

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.errors import InputError
from desim.network.medium import Medium
from netmodels.cases.traffic import SAME_POWER
from netmodels.radio.dcf.radio import DcfRadio

SECONDS = 4

# ns-3 3.44, 802.11n, MCS 7, 20 MHz, no aggregates, TXOP limits as in Linux, two runs of 6 s:
# category, stations, of which half have it and half best effort; Mb/s of 1000 B of UDP of these,
# and of all.
NS3 = [("voice", 4, 30.27, 31.19), ("voice", 10, 29.68, 29.78),
       ("video", 4, 34.37, 34.42), ("video", 10, 34.30, 34.34)]


def goodput(category, stations):
    """Mb/s of the stations of that category, and of all: two media that share a channel."""
    kernel, names = Kernel(), Names()
    hosts = [f"station_{k}" for k in range(stations)] + ["sink"]
    media = [Medium(f"wifi_{one}", DcfRadio(DcfRadio.Params(
        preset="ns3_3_44", standard="11n", mcs=7, channel=36, aggregation=False,
        access_category=one, path_loss=SAME_POWER)), (), kernel=kernel, names=names,
        streams=Streams(1), hosts=hosts) for one in dict.fromkeys(("best_effort", category))]
    flows = [Flow(media[-1 if k >= stations // 2 else 0], k, stations) for k in range(stations)]
    kernel.run(SECONDS * 10**9)
    mbps = [flow.received * 8e-3 / SECONDS for flow in flows]
    return sum(mbps[stations // 2:]), sum(mbps)


@pytest.mark.parametrize(("category", "stations", "mbps", "all_mbps"), NS3)
def test_shares_of_the_air_are_those_of_ns3(category, stations, mbps, all_mbps):
    assert goodput(category, stations) == pytest.approx((mbps, all_mbps), rel=0.03)


def test_the_twin_of_one_category_shares_alike():
    mbps, all_mbps = goodput("best_effort", 4)
    assert mbps == pytest.approx(all_mbps / 2, rel=0.1)


def test_stations_without_qos_have_no_category():
    with pytest.raises(InputError) as said:
        DcfRadio(DcfRadio.Params(standard="11g", access_category="voice"))
    assert str(said.value) == (".access_category: 11g has none; allowed with 11n, 11ac, "
                               "11ax and with qos: true")
