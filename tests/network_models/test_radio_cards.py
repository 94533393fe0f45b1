"""Cards of radios: what they set, what overrides them, and that what they set is what they name."""

import pytest

from desim.commands.views.catalogue import description
from desim.errors import InputError
from desim.netcases.case import play
from desim.ports.cases import Flow, Setup
from desim.scenario.load import from_mapping
from netmodels.radio.cards import CARDS
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.radio import Radio

NEAR_M = 5.0  # nothing is lost over so few metres


def params(**given):
    return DcfRadio.Params(**given)


@pytest.mark.parametrize(("card", "middle_mbps", "best_mbps", "carrier_mhz"), [
    ("pi_4", 195, 433.3, 5180),  # 802.11-2016, table 21-46; the data sheet's 433.3 Mb/s
    ("intel_8265", 390, 866.7, 5180),  # table 21-47
    ("intel_ax200", 432.4, 1201, 5180),  # 802.11ax-2021, 27.5: 996 tones
    ("11g_2008", 54, 54, 2412),
    ("esp_now", 1, 11, 2412),
])
def test_rates_are_those_of_the_card(card, middle_mbps, best_mbps, carrier_mhz):
    radio = DcfRadio(params(card=card))
    rates = radio.standard.rates
    assert rates[radio.params.rates()[0]].mbps == pytest.approx(middle_mbps, abs=0.1)
    assert max(rate.mbps for rate in rates) == pytest.approx(best_mbps, abs=0.1)
    assert radio.standard.carrier_hz(radio.params.channel) == carrier_mhz * 1e6


@pytest.mark.parametrize("card", CARDS)
def test_a_card_is_its_values_and_nothing_else(card):
    spelled_out = params(**CARDS[card].values)
    assert params(card=card).model_copy(update={"card": None}) == spelled_out


def test_the_old_card_is_what_radios_without_one_are():
    assert params(card="11g_2008").model_copy(update={"card": None}) == params()


def test_the_scenario_overrides_the_card_and_the_card_the_preset():
    found = params(card="pi_4", preset="ns3_3_44", width="40 MHz", mcs=7)
    assert (found.width_hz, found.mcs) == (40e6, 7)  # given
    assert (found.standard, found.channel, found.power_dbm) == ("11ac", 36, 16.0)  # the card's
    assert found.path_loss.exponent == 3.0  # the preset's
    assert params(preset="ns3_3_44").power_dbm == 16.0206
    assert params(card="pi_4", rate_control={}).rate_control.model == "minstrel_ht"
    assert params(card="pi_4", rate_control={"model": "arf"}).rate_control.model == "arf"
    assert params(card="pi_4", rate_control=None).rate_control is None


def test_a_pi_in_24_ghz():
    """The band of a TurtleBot 4's base: 802.11n in 20 MHz, with one stream at most 72.2 Mb/s."""
    radio = DcfRadio(params(card="pi_4", standard="11n", channel=1, width="20 MHz"))
    assert radio.standard.carrier_hz(1) == 2412e6
    assert radio.standard.carrier_hz(14) == 2484e6  # not 2477
    assert max(rate.mbps for rate in radio.standard.rates) == pytest.approx(72.2, abs=0.1)


def test_an_older_standard_needs_a_width_that_it_has():
    with pytest.raises(InputError) as said:
        params(card="pi_4", standard="11n").rates()
    assert str(said.value) == (
        ".width: 11n has no channels of 80 MHz; allowed: 20 MHz, 40 MHz")


def goodput_mbps(metres, **given):
    radio = Radio.build(Radio.Params(preset="indoor", shadowing=None, **given))
    flow = Flow("robot", ("base",), 1518, 1472, train=64)
    places = {"robot": (metres, 0.0), "base": (0.0, 0.0)}
    return play(Setup(radio, places, [flow], 2 * 10**9, 10**9))["goodput_mbps"]


def test_a_pi_near_by_carries_what_its_fastest_rate_does():
    """And far away more than its fastest rate: a twin that learns nothing gets nothing there."""
    assert goodput_mbps(NEAR_M, card="pi_4") == pytest.approx(
        goodput_mbps(NEAR_M, card="pi_4", rate_control=None, mcs=9), rel=0.05)
    assert goodput_mbps(160.0, card="pi_4") > 100
    assert goodput_mbps(160.0, card="pi_4", rate_control=None, mcs=9) == 0


def under_an_access_point(**given):
    access_point = {"at": ["0 m", "0 m"], "channel": 36}
    scenario = from_mapping({"name": "x", "deployment": "field", "network": {"media": {"air": {
        "access_points": [access_point], **given}}}}).scenario
    return [key for unused in scenario.network.media["air"].params.without_effect(scenario)
            for key in unused.keys]


def test_the_cards_channel_under_access_points_is_no_key_without_effect():
    assert under_an_access_point() == []
    assert under_an_access_point(channel=40) == [".channel"]


def test_describe_says_what_a_card_stands_for():
    lines = description("radio").splitlines()
    for name, card in CARDS.items():
        assert f"  {name}: {card.about}." in lines
    assert ("    {standard: 11g, rate: 54 Mb/s, power: 16.0206 dBm}") in lines
    assert ("    {standard: 11ac, channel: 36, width: 80 MHz, mcs: 4, guard_interval: 400 ns, "
            "rate_control: {model: minstrel_ht}, power: 16 dBm}") in lines


def test_describe_shows_one_card_whole():
    assert description("pi_4").splitlines() == [
        "pi_4 (card of radio): {model: radio, card: pi_4}", "", f"{CARDS['pi_4'].about}.", "",
        "values:", "  standard: 11ac", "  mcs: 4", "  streams: 1  (default)", "  width: 80 MHz",
        "  guard_interval: 0.4 us", "  aggregation: True  (default)", "  qos: False  (default)",
        "  access_category: best_effort  (default)", "  rate: 195 Mb/s",
        "  rate_control: {model: minstrel_ht}", "  channel: 36", "  power: 16 dBm",
        "  people: True  (default)", "  queue: 500  (default)", "  retries: 7  (default)",
        "  update: 0.1 s  (default)", "  fidelity: mac  (default)"]
    with pytest.raises(InputError, match=r"unknown plug-in 'pi4' \(did you mean 'pi_4'\?\)"):
        description("pi4")


def test_describe_names_the_cards_at_their_parameter():
    line = next(line for line in description("radio").splitlines() if line.startswith("  card:"))
    assert line.endswith("; one of pi_4, intel_8265, intel_ax200, 11g_2008, esp_now")


@pytest.mark.parametrize("card", CARDS)
def test_every_rung_takes_every_card(card):
    for fidelity in ("disk", "walls", "mac", "multihop"):
        assert Radio.build(Radio.Params(card=card, fidelity=fidelity))
