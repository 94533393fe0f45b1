"""Cards: what radios that one can buy have, under a name, with the source."""

from __future__ import annotations

from desim import ports

# Alike with and without learning: one that does not learn sends at the middle of its rates.
_AC: dict[str, object] = {"standard": "11ac", "channel": 36, "width": "80 MHz", "mcs": 4,
                          "guard_interval": "400 ns", "rate_control": {"model": "minstrel_ht"}}

CARDS = {
    "pi_4": ports.Named(
        "a Raspberry Pi 4, as in a TurtleBot 4 (2022): 802.11ac, one stream, 80 MHz (Cypress "
        "CYW43455, data sheet 002-15051), in 5 GHz, where a TurtleBot 4 opens its network "
        "(github.com/turtlebot/turtlebot4/issues/56). Its driver offers ad hoc cells (IBSS: "
        "github.com/raspberrypi/linux/issues/4429); that their rates are those of 802.11ac is our "
        "assumption. 16 dBm: a board file of the chip (linux-firmware, brcmfmac43455-sdio.txt of "
        "AP6255) has at most 20 dBm, 2.5 dB less at MCS 5 to 7, 6 dB less at MCS 9, and 1.5 dB are "
        "margin. How its firmware chooses rates is not published: here as Minstrel-HT. Its bus "
        "(SDIO, 167 Mb/s at best: github.com/raspberrypi/linux/issues/4390) is left out",
        {**_AC, "power": "16 dBm"}),
    "intel_8265": ports.Named(
        "an Intel Dual Band Wireless-AC 8265 or 9260, of many small computers: 802.11ac, two "
        "streams, 80 MHz (data sheets). Its driver declares ad hoc cells with these rates (Linux, "
        "iwlwifi/mvm/mac80211.c: NL80211_EXT_FEATURE_VHT_IBSS), and has a rate control of its own "
        "(iwl-mvm-rs): here as Minstrel-HT",
        {**_AC, "streams": 2}),
    "intel_ax200": ports.Named(
        "an Intel Wi-Fi 6 AX200 or AX210: 802.11ax, two streams up to MCS 11 (1201 Mb/s in 80 MHz: "
        "jeffgeerling.com/blog/2021/wifi-6-not-faster-ethernet-on-raspberry-pi), for access "
        "points: ad hoc its driver declares no more than 802.11ac. Rates as of intel_8265",
        {**_AC, "standard": "11ax", "guard_interval": "800 ns", "streams": 2}),
    "11g_2008": ports.Named(
        "a card of 802.11g, as robots had it until about 2012: always 54 Mb/s (nominal), 40 mW "
        "(ns-3). These are also the defaults without a card",
        {"standard": "11g", "rate": "54 Mb/s", "power": "16.0206 dBm"}),
    "esp_now": ports.Named(
        "an ESP32 with ESP-NOW: 802.11b at 1 Mb/s, 20 dBm (ESP-IDF's defaults). It stands for the "
        "air alone: a packet has headers of IP, UDP and LLC, 21 B more than the vendor's action "
        "frame (43 B and the data: ESP-IDF's guide, frame format), which last 168 us longer, and "
        "it may have more than the 250 B of data of version 1.0: send less",
        {"standard": "11b", "rate": "1 Mb/s", "broadcast_rate": "1 Mb/s", "power": "20 dBm"}),
}


def with_card(given: object) -> object:
    """Parameters with the values of their card where ``given`` has none."""
    return ports.with_preset(ports.tuples(given), "card", "",
                             {name: card.values for name, card in CARDS.items()})
