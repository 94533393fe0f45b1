"""The radios of the DARPA Subterranean Challenge's virtual tracks."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import BitRate, Length, Level
from netmodels.compatible.gz_rfcomms import GzRfComms, RfParams, Sigma
from netmodels.compatible.obstruction import walls_between


class Subt(GzRfComms):
    """The communication model of the SubT Challenge, visibility_range (osrf/subt): Gazebo's radio,
    of which this is the origin, with an exponent that grows with what is in the way.

    exponent = ``exponent`` + ``exponent_per_cost`` * cost, and nothing arrives where the cost is
    above ``most_cost``. SubT has the cost of two places in a table that was made of the tiles of
    its worlds; here it is ``wall_cost`` for each wall on the straight line. All else is as in
    ``gz_rfcomms``: log-normal power, errors of QPSK, capacity by epoch.

    Left out: breadcrumbs (relays that robots drop), and the later scaling of the distance by hops
    over them (scaling_factor, range_per_hop). A host without a place gets and sends nothing.

    Capabilities: Itemizes, LimitsReach.
    """

    class Params(RfParams):
        range_m: Length = Field("500 m", gt=0, description="nothing gets farther, max_range (subt)")
        sigma_is: Sigma = Field("variance", description=(
            "what sigma is used as, variance or deviation (subt: a standard deviation of 3.16 dB)"))
        power_dbm: Level = Field("20 dBm", description="sent, tx_power (subt)")
        capacity_bps: BitRate = Field("1 Mb/s", description="of each sender and of each receiver "
                                                            "(subt)")
        exponent_per_cost: float = Field(0.2, ge=0, le=20, description=(
            "visibility_cost_to_fading_exponent (subt)"))
        most_cost: float = Field(10.0, ge=0, description="comms_cost_max (subt; at first 15)")
        wall_cost: float = Field(1.0, ge=0, description="of one wall (a guess: SubT's costs are "
                                                        "those of its tiles)")

    _stream = "subt"
    _params: Params

    def send(self, frame: ports.Frame) -> None:
        context, params = self._context, self._params
        places = context.positions(context.now_ns)
        here, there = places[frame.source], places[list(frame.receivers)]
        cost = params.wall_cost * walls_between(context.obstacles, here, there)
        exponents = np.where(cost > params.most_cost, np.nan,
                             params.exponent + params.exponent_per_cost * cost)
        self._settle(frame, np.hypot(*(there - here).T), exponents)
