"""The addresses of hosts with real programs."""

from __future__ import annotations

from ipaddress import ip_address, ip_network

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.loop.addresses import MAX_HOSTS, MAX_MEDIA, Address, host_of, is_group

ADDRESSES = st.builds(Address, st.integers(0, MAX_MEDIA - 1), st.integers(0, MAX_HOSTS - 1))


@pytest.mark.parametrize(("medium", "host", "ip", "mac", "interface"), [
    (0, 0, "10.77.0.1", "02:00:00:00:00:00", "eth0"),
    (1, 254, "10.78.0.255", "02:00:00:01:00:fe", "eth1"),
    (0, 255, "10.77.1.0", "02:00:00:00:00:ff", "eth0"),
    (MAX_MEDIA - 1, MAX_HOSTS - 1, "10.176.255.254", "02:00:00:63:ff:fd", "eth99")])
def test_an_address_says_medium_and_host(medium, host, ip, mac, interface):
    own = Address(medium, host)
    assert (own.ip, own.mac.hex(":"), own.interface) == (ip, mac, interface)


@given(ADDRESSES, ADDRESSES)
def test_no_two_interfaces_share_an_address(one, other):
    assert (one == other) == (one.ip == other.ip) == (one.mac == other.mac)


@given(ADDRESSES)
def test_an_address_is_one_of_its_medium_s_network_and_leads_back_to_the_host(own):
    network = ip_network(f"10.{77 + own.medium}.0.0/16")
    assert ip_address(own.ip) in network
    assert ip_address(own.ip) not in (network.network_address, network.broadcast_address)
    assert host_of(own.mac) == own.host and not is_group(own.mac)


@pytest.mark.parametrize(("mac", "group"), [
    ("ff:ff:ff:ff:ff:ff", True), ("01:00:5e:00:00:fb", True), ("33:33:00:00:00:01", True),
    ("52:54:00:12:34:56", False)])
def test_addresses_of_others_are_no_host_s(mac, group):
    mac = bytes.fromhex(mac.replace(":", ""))
    assert host_of(mac) is None
    assert is_group(mac) is group


@given(st.binary(max_size=6))
def test_a_part_of_an_address_is_some_host_or_none(mac):
    assert host_of(mac) is None or mac[:3] == b"\x02\x00\x00"
