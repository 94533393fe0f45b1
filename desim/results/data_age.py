"""The age of the data on which messages are based: from a scan's birth to a command's arrival."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from desim.results.message_columns import words_of

# From a reading's birth to its arrival; until its node looks at it first; until the callback that
# publishes the message is called; until the message's birth; and until its arrival.
PARTS = ("reading's way", "unread", "kept", "callback", "latency")


@dataclass(frozen=True)
class DataAge:
    """The age of the newest message that the sender of each of ``messages`` had read when it
    computed it, at the arrival of the latter: the mean and the longest (ns), and the mean of each
    of ``PARTS``, which sum up to it. ``blind``: messages whose sender had read none."""

    messages: int
    blind: int
    mean_ns: float
    longest_ns: int
    parts_ns: dict[str, float]


def data_age(readings: pa.Table, messages: pa.Table) -> DataAge:
    """The ages of the data of ``messages``, in ``readings``; both are rows of a ledger (of
    ``ledger.SCHEMA``), ``messages`` delivered. A message is based on what its host had read last
    when the callback that published it was called (on ideal computers: at its birth)."""
    readings = readings.filter(pc.is_valid(readings["read_ns"])).sort_by("read_ns")
    called_ns = pc.coalesce(messages["called_ns"], messages["born_ns"]).to_numpy()
    hosts, sender = words_of(messages["source"])
    read_at = np.array(readings["destination"].cast(pa.string()))
    newest = np.full(len(messages), -1)  # row of the readings
    for host, name in enumerate(hosts):
        of_host, own = np.flatnonzero(read_at == name), sender == host
        read_ns = readings["read_ns"].to_numpy()[of_host]
        newest[own] = np.append(of_host, -1)[
            np.searchsorted(read_ns, called_ns[own], side="right") - 1]
    based, newest = newest >= 0, newest[newest >= 0]
    if not len(newest):
        return DataAge(0, len(messages), 0.0, 0, {})
    of, own = readings.take(pa.array(newest)), messages.filter(pa.array(based))
    instants = np.stack([of["born_ns"], of["end_ns"], of["read_ns"], called_ns[based],
                         own["born_ns"], own["end_ns"]])
    ages_ns = instants[-1] - instants[0]
    means_ns = np.diff(instants, axis=0).mean(axis=1).tolist()
    return DataAge(len(newest), len(messages) - len(newest), float(ages_ns.mean()),
                   int(ages_ns.max()), dict(zip(PARTS, means_ns, strict=True)))
