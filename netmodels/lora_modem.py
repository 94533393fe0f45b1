"""LoRa's modem: airtimes, sensitivities, and what LoRaWAN lets it carry."""

from __future__ import annotations

_PREAMBLE_SYMBOLS = 8  # EU868
_LONG_SYMBOL_NS = 16_000_000  # from here on low data rates are optimized
# The most bytes of payload by spreading factor (LoRaWAN 1.0.3 regional parameters, EU868, with
# room for a repeater).
MOST_BYTES = {7: 222, 8: 222, 9: 115, 10: 51, 11: 51, 12: 51}
# SX1276/77/78/79 datasheet, rev. 7, RFS_L125_HF, RFS_L250_HF, RFS_L500_HF: dBm from SF7 to SF12.
SENSITIVITY_DBM = {125: (-123, -126, -129, -132, -133, -136),
                   250: (-120, -123, -125, -128, -130, -133),
                   500: (-116, -119, -122, -125, -128, -130)}


def lora_airtime_ns(size_bytes: int, spreading: int, bandwidth_khz: int, coding: int = 1,
                    crc: bool = True) -> int:
    """The airtime of ``size_bytes`` behind an explicit header (SX1276 datasheet, 4.1.1.7);
    ``coding`` 1 to 4 is 4/5 to 4/8. A preamble of n + 4.25 symbols, and 8 + max(ceil((8 PL - 4 SF
    + 28 + 16 CRC) / (4 (SF - 2 DE))) (CR + 4), 0) of the payload, of 2^SF / bandwidth each."""
    symbol_ns = 2 ** spreading * 1_000_000 // bandwidth_khz
    slow = symbol_ns >= _LONG_SYMBOL_NS
    blocks = -(-(8 * size_bytes - 4 * spreading + 28 + 16 * crc) // (4 * (spreading - 2 * slow)))
    return symbol_ns * (4 * _PREAMBLE_SYMBOLS + 17) // 4 + symbol_ns * (
        8 + max(blocks * (coding + 4), 0))
