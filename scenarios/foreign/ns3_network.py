"""Wi-Fi by ns-3 (pip install ns3), in lock-step with desim: ns3_wifi.h is the network.

Walls weaken nothing; hosts without a place are at (0, 0). A process runs one such network at a
time. desim's radio is alike with ``preset: ns3_3_44`` and ``walls: null``."""

from collections import defaultdict
from pathlib import Path
from typing import Literal

import cppyy
import ns3
import numpy as np
from pydantic import Field

from desim import ports

[FOLDER] = ns3.__path__
cppyy.add_include_path(f"{FOLDER}/include")
cppyy.load_library(str(next(Path(FOLDER).glob("lib*/libns3*-wifi.so"))))
cppyy.include(str(Path(__file__).with_name("ns3_wifi.h")))
NS3, WIFI = cppyy.gbl.ns3, cppyy.gbl.wifi
ETHERNET_BYTES = 18  # of a frame's size, which 802.11 does not have


class Ns3:
    """See ``desim.ports.NetworkModel`` and ``desim.ports.Federate``."""

    class Params(ports.Params):
        rate: Literal["6 Mb/s", "9 Mb/s", "12 Mb/s", "18 Mb/s", "24 Mb/s", "36 Mb/s", "48 Mb/s",
                      "54 Mb/s"] = Field("54 Mb/s", description="of unicast frames")

    reasons = ("queue_full", "expired", "retry_limit", "old", "missed")
    refuses = ("queue_full",)

    def __init__(self, params):
        self._mode = f"ErpOfdmRate{params.rate.split()[0]}Mbps"

    def start(self, context, hosts):
        self._context, self._places, self._packets = context, None, {}
        WIFI.Start(len(hosts), self._mode, int(context.stream("ns-3").integers(1, 1 << 32)))

    def send(self, frame):
        fates = defaultdict(list)  # of its packets, by receiver
        to = WIFI.ALL if frame.broadcast else frame.receivers[0]
        for k, size_bytes in enumerate(ports.packet_sizes(frame.size_bytes, frame.segments)):
            packet = WIFI.Send(frame.source, to, max(size_bytes - ETHERNET_BYTES, 0))
            self._packets[packet] = frame, k, set(frame.receivers), fates

    def advance(self, to_ns):
        places = self._context.positions(self._context.now_ns)
        if places is not self._places:  # somebody has moved
            self._places = places
            for radio, (x_m, y_m) in zip(WIFI.radios, np.nan_to_num(places).tolist(), strict=True):
                mobility = radio.GetNode().GetObject[NS3.MobilityModel]()
                mobility.SetPosition(NS3.Vector(x_m, y_m, 0))
        if WIFI.fates.empty():
            end = NS3.Simulator.Stop(NS3.NanoSeconds(to_ns) - NS3.Now())
            NS3.Simulator.Run()
            end.Cancel()
        reached_ns = NS3.Now().GetNanoSeconds()
        for fate in WIFI.fates:
            self._context.at(reached_ns, self._settle, (fate.packet, fate.host, fate.reason))
        WIFI.fates.clear()
        return reached_ns

    def _settle(self, fate):
        packet, host, reason = fate
        frame, k, left, fates = self._packets.get(packet, (None, 0, set(), None))
        for receiver in sorted(left if host == WIFI.ALL else left & {host}):
            left.remove(receiver)
            fates[receiver].append(reason)
            if reason != WIFI.ARRIVED:
                self._context.settle(frame, receiver, ports.Drop(self.reasons[reason], (k,)))
            if len(fates[receiver]) == frame.segments and WIFI.ARRIVED in fates[receiver]:
                self._context.settle(frame, receiver, ports.Deliver(0))
        if not left:
            self._packets.pop(packet, None)
