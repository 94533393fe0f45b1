"""Every group of ``desim validate`` agrees where it is quick to see, and has a twin.

With one constant of physics 5 to 10 % off the same comparisons fail. The whole is what the command
is for.
"""

from dataclasses import dataclass, replace
from itertools import islice

import pytest

from desim import ports
from desim.netcases.case import play
from desim.ports.cases import Check
from netmodels import access_link, aloha, bus
from netmodels.cases import chain
from netmodels.infrastructure.background_scans import BackgroundScans
from netmodels.infrastructure.joining import JoiningConstants
from netmodels.radio import (
    access_categories,
    best_rate,
    delivery,
    errors,
    modulation,
    path_loss,
    rate_control,
)
from netmodels.radio.budget import RadioLinks
from netmodels.radio.dcf import radio as dcf_radio
from netmodels.radio.dcf.stations import Aggregation
from netmodels.radio.errors import bit_error
from netmodels.radio.minstrel import statistics as minstrel_statistics
from netmodels.radio.presets import PRESETS
from netmodels.radio.standards import STANDARDS
from netmodels.radio.thresholds import Thresholds
from netmodels.rules.loss import GilbertElliott
from netmodels.rules.outage import Flapping
from netmodels.rules.timing import Latency
from netmodels.validation import access_points, propagation, rfcomms
from netmodels.validation.access_categories import AccessCategories
from netmodels.validation.access_points import AccessPointsOfNs3
from netmodels.validation.aggregates import AmsdusOfNs3, BlocksOf256, SaturationOfMcs
from netmodels.validation.associations import AccessPointsOfLinux
from netmodels.validation.chain import Chains, repaired
from netmodels.validation.many_senders import DelaysOfRadio, ManyPairs, Mixes, RelayedFlows
from netmodels.validation.minstrel_ht import MinstrelOfLinux
from netmodels.validation.minstrel_ht_ns3 import MinstrelOfNs3
from netmodels.validation.one_link import DiskOfRadio, FadingOutage, SinglePair
from netmodels.validation.places import HiddenTerminals, TwoPairsOfNs3
from netmodels.validation.propagation import PacketErrors, Propagation
from netmodels.validation.queues import FiniteQueue, PeriodicSenders, WaitingTimes
from netmodels.validation.rate_control import FallbackOfRates
from netmodels.validation.rates_of_ns3 import IDEAL_HT_2, RatesOfNs3
from netmodels.validation.rfcomms import RadioOfGazebo
from netmodels.validation.rules import Bursts, Delays, FlappingAvailability, RoundTrip
from netmodels.validation.shared_channels import (
    CarrierSenseOfNs3,
    CollisionsOfEthernet,
    RandomAccess,
)
from netmodels.validation.stations import Heartbeats, SaturationOf11b, SaturationOfOfdm

for_stations = Thresholds.for_stations


@dataclass(frozen=True)
class Spreading(path_loss.LogDistance):
    def loss_db(self, distance_m):
        return path_loss.LogDistance(0.95 * self.exponent, self.reference_db).loss_db(distance_m)


def slower_rates(monkeypatch):
    """Links 5 % slower than they say."""
    monkeypatch.setattr(access_link, "airtime_ns", lambda size_bytes, rate_bps: (
        size_bytes * 8 * 10**9 * 21 // (20 * rate_bps)))


def slower_bus(monkeypatch):
    monkeypatch.setattr(bus, "airtime_ns", lambda size_bytes, rate_bps: (
        size_bytes * 8 * 10**9 * 11 // (10 * rate_bps)))


def longer_frames(monkeypatch):
    monkeypatch.setattr(aloha, "airtime_ns", lambda size_bytes, rate_bps: (
        size_bytes * 8 * 10**9 * 21 // (20 * rate_bps)))


def longer_slots(monkeypatch):
    monkeypatch.setattr(bus, "SLOT_BITS", 563)


def shorter_interference(monkeypatch):
    monkeypatch.setattr(chain, "INTERFERENCE", 0.905 * chain.INTERFERENCE)


def longer_symbols(monkeypatch):
    rates = tuple(rate._replace(symbol_ns=4_400) for rate in STANDARDS["11a"].rates)
    monkeypatch.setitem(STANDARDS, "11a", replace(STANDARDS["11a"], rates=rates))


def longer_preambles(monkeypatch):
    rates = tuple(rate._replace(payload_ns=211_200) for rate in STANDARDS["11b"].rates)
    monkeypatch.setitem(STANDARDS, "11b", replace(STANDARDS["11b"], rates=rates))


def less_loss(monkeypatch):
    monkeypatch.setitem(path_loss._MODELS, "log_distance", Spreading)
    monkeypatch.setattr(propagation, "LogDistance", Spreading)


def less_indoor_loss(monkeypatch):
    """5 % less by decade, of ITU-R P.1238 alone."""
    monkeypatch.setitem(path_loss._BUILDINGS, "office", (28.5, 15.0, 4.0))


def more_signal(monkeypatch):
    monkeypatch.setattr(errors, "bit_error", lambda mbps, ratio: bit_error(mbps, 1.05 * ratio))


def once_begun(monkeypatch, rule, change):
    """Change what a rule knows after its start."""
    start = rule.start

    def changed(self, context, hosts):
        start(self, context, hosts)
        change(self)

    monkeypatch.setattr(rule, "start", changed)


def more_latency(monkeypatch):
    def change(rule):
        rule._fixed = ports.Deliver(rule._delay_ns * 21 // 20)

    once_begun(monkeypatch, Latency, change)


def more_bursts(monkeypatch):
    def change(rule):
        good, bad = rule._change
        rule._change = 1.1 * good, bad

    once_begun(monkeypatch, GilbertElliott, change)


def longer_spells(monkeypatch):
    """Of being down."""
    def change(rule):
        for spells in rule._hosts.values():
            down_ns, up_ns = spells._mean_ns
            spells._mean_ns = 1.1 * down_ns, up_ns

    once_begun(monkeypatch, Flapping, change)


def more_jitter(monkeypatch):
    def change(rule):
        rule._jitter_ns *= 1.1

    once_begun(monkeypatch, Latency, change)


def more_loss_in_gazebo(monkeypatch):
    monkeypatch.setitem(rfcomms.WORLDS, "exponent", 2.625)


def more_noise_in_gazebo(monkeypatch):
    monkeypatch.setitem(rfcomms.WORLDS, "noise", "-85.5 dBm")


def deafer_receivers(monkeypatch):
    """By 10 %."""
    monkeypatch.setattr(Thresholds, "for_stations", lambda self: replace(
        for_stations(self), preamble_dbm=self.preamble_dbm + 0.414))


def noisier_receivers(monkeypatch):
    monkeypatch.setitem(PRESETS["ns3_3_44"]["reception"], "noise_figure", "7.7 dB")


def better_receivers(monkeypatch):
    monkeypatch.setitem(PRESETS["ns3_3_44"]["reception"], "noise_figure", "6.3 dB")


def nobody_leaves(monkeypatch):
    monkeypatch.setattr(chain._Deserted, "_leave", lambda self, way: None)


def longer_disks(monkeypatch):
    """Only where the range is computed."""
    monkeypatch.setattr(delivery, "bit_error", lambda mbps, ratio: bit_error(mbps, 1.05 * ratio))


def carrier_sense_of_the_standard(monkeypatch):
    monkeypatch.setitem(PRESETS["ns3_3_44"]["reception"], "energy", "-62 dBm")


def nothing_on_the_way(monkeypatch):
    """Nobody knows which of two frames of one slot comes first."""
    monkeypatch.setattr(RadioLinks, "delays_ns", lambda self, places: 0)


def no_requests(monkeypatch):
    monkeypatch.setitem(PRESETS["ns3_3_44"]["constants"], "block_requests", False)


def together(monkeypatch):
    """The packets of an aggregate arrive with its end."""
    monkeypatch.setitem(PRESETS["ns3_3_44"]["constants"], "apart", False)


def given_up(monkeypatch):
    """A packet of an aggregate is sent seven times at most."""
    monkeypatch.setitem(PRESETS["ns3_3_44"]["constants"], "block_endless", False)


def busy_after_sending(monkeypatch):
    """With 802.11ax, too, who has sent finds the medium busy from -82 dBm."""
    constants = PRESETS["ns3_3_44"]["reception"]["constants"]
    monkeypatch.setitem(constants, "idle_after_sending", False)


def slower_filter(monkeypatch):
    """A period of 17 updates, not 16."""
    monkeypatch.setattr(minstrel_statistics, "_SECOND", 5466)
    monkeypatch.setattr(minstrel_statistics, "_THIRD", -2429)


def no_pause(monkeypatch):
    monkeypatch.setitem(PRESETS["ns3_3_44"]["constants"], "difs_first", False)


def no_txop(monkeypatch):
    """Each category sends one frame at a time."""
    categories = access_categories.categories
    for module in modulation, dcf_radio:
        monkeypatch.setattr(module, "categories", lambda standard: tuple(
            one._replace(txop_ns=0) for one in categories(standard)))


class Repairs:
    """The second half of ``Chains``."""

    def checks(self, play):
        return repaired(play, "ideal", 1)


# Group, how many of its comparisons it takes to see what is made wrong, and that.
def longer_visits(monkeypatch):
    """By a tick in eight."""
    monkeypatch.setattr(JoiningConstants, "dwell_ns", lambda constants, channel: (
        9 * constants.tick_ns))


def exact_signals(monkeypatch):
    """The mean of a signal is not rounded down."""
    hear = BackgroundScans.hear
    monkeypatch.setattr(BackgroundScans, "hear", lambda scans, now_ns, power_dbm: hear(
        scans, now_ns, power_dbm - 1))


def each_by_itself(monkeypatch):
    """No A-MSDUs."""
    monkeypatch.setattr(dcf_radio.DcfRadio.Params, "aggregated", lambda params: Aggregation(
        requests=True, apart=True))


def blocks_of_64(monkeypatch):
    monkeypatch.setattr(dcf_radio.DcfRadio.Params, "aggregated", lambda params: Aggregation(
        size_bytes=params.constants.aggregate_bytes, requests=True, apart=True))


def always_as_soon(monkeypatch):
    """A failed probe changes nothing: ARF."""
    monkeypatch.setattr(rate_control, "_MOST_UP_AFTER", {})


def bolder_rates(monkeypatch):
    """They need 5 dB more than they say."""
    monkeypatch.setattr(best_rate, "bit_error", lambda mbps, ratio: bit_error(mbps, 3 * ratio))


class RatesOfTwoStreams(RatesOfNs3):
    all = (IDEAL_HT_2,)


TWINS = [
    (SaturationOfOfdm, 1, longer_symbols), (SaturationOf11b, 1, longer_preambles),
    (WaitingTimes, 1, slower_rates), (FiniteQueue, 1, slower_rates),
    (PeriodicSenders, 4, slower_rates),
    (CarrierSenseOfNs3, 6, slower_bus), (CollisionsOfEthernet, 1, longer_slots),
    (RandomAccess, 1, longer_frames), (TwoPairsOfNs3, 8, less_loss),
    (HiddenTerminals, 6, less_loss),
    (Heartbeats, 1, longer_symbols), (Chains, 3, shorter_interference),
    (Propagation, 27, less_loss), (SinglePair, 6, noisier_receivers),
    (Repairs, 1, nobody_leaves), (PacketErrors, 12, more_signal), (RoundTrip, 2, more_latency),
    (RadioOfGazebo, 36, more_loss_in_gazebo),
    (DiskOfRadio, 4, longer_disks), (Bursts, 1, more_bursts),
    (FlappingAvailability, 1, longer_spells),
    (Delays, 8, more_jitter), (FadingOutage, 1, deafer_receivers),
    (FallbackOfRates, 1, longer_symbols), (ManyPairs, 1, carrier_sense_of_the_standard),
    (RelayedFlows, 4, nothing_on_the_way), (Mixes, 1, carrier_sense_of_the_standard),
    (DelaysOfRadio, 4, no_pause), (SaturationOfMcs, 6, no_requests),
    (AmsdusOfNs3, 1, each_by_itself), (BlocksOf256, 1, blocks_of_64),
    (AccessCategories, 3, no_txop),
    (MinstrelOfLinux, 1, slower_filter), (MinstrelOfNs3, 2, less_loss),
    (RatesOfNs3, 2, always_as_soon), (RatesOfTwoStreams, 3, bolder_rates),
    (AccessPointsOfNs3, 3, no_requests), (AccessPointsOfNs3, 3, together),
    (AccessPointsOfNs3, 5, given_up), (AccessPointsOfNs3, 7, busy_after_sending),
    (AccessPointsOfLinux, 2, longer_visits), (AccessPointsOfLinux, 5, exact_signals),
    *(pytest.param(*twin, marks=pytest.mark.validation) for twin in (  # the second of these groups
        (Propagation, 27, less_indoor_loss), (SinglePair, 6, better_receivers),
        (RadioOfGazebo, 36, more_noise_in_gazebo))),
]


def first(group, count):
    """They are played one after the other, as they are asked for."""
    return islice(group().checks(play), count)


@pytest.fixture(autouse=True)
def shorter_rows(monkeypatch):
    """The command plays contending stations for 40 s; these rows and their twins differ sooner."""
    monkeypatch.setattr(access_points, "_CONTENDING_S", 15)


@pytest.mark.parametrize(("group", "count", "wrong"), TWINS)
def test_group_agrees_and_its_twin_does_not(monkeypatch, group, count, wrong):
    assert [check for check in first(group, count) if not check.holds] == []
    wrong(monkeypatch)
    assert not all(check.holds for check in first(group, count))


@pytest.mark.parametrize(("measured", "holds"), [(9.0, True), (11.0, True), (11.1, False),
                                                 (float("nan"), False)])
def test_a_check_holds_within_its_tolerance(measured, holds):
    assert Check("it", measured, 10.0, 1.0).holds is holds
