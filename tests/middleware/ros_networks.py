"""Small networks for tests of the ROS 1 middleware: their outages, and their logs."""

from configured import configured
from graphs import Life, Net, S

from desim.middleware.ros1.ros1 import Ros1
from netmodels.ideal import Ideal
from netmodels.rules.partition import Partition

SYNS_S = (0, 1, 2, 3, 4, 5, 7, 11, 19, 35, 67)  # of one attempt, after its first
GIVEN_UP_S = 131  # after it

# Neither processes nor masters look only now and then, or ask before they register.
AT_ONCE = {"poll": "0 s", "worker_poll": "0 s", "parameters": 0}


def one_master(nodes, rules=(), **params):
    """Hosts 10 ms apart, a round trip of 20 ms, with one master, on host m if it is not said,
    timers that are exact, and addresses that are known."""
    params = {"master": "m", **AT_ONCE} | params
    params["tcp"] = {"tick": "0 ns", "arp": "static"} | params.get("tcp", {})
    return Net(nodes, Ideal(Ideal.Params(delay="10 ms")), rules,
               middleware=Ros1(configured(Ros1.Params, **params)))


def says(*at_s):
    """The messages of a talker: the times themselves, in s."""
    return [(round(at * S), str(at)) for at in at_s]


def apart(*hosts, start="0 s", until="10 h"):
    """A rule that cuts these hosts off from the others."""
    return Partition(Partition.Params(groups=[list(hosts)], **{"from": start, "until": until}))


def stop(net, host, at_s, back_s=None, begin=None):
    """The host stops, and may come back, with another node."""
    host = net.graph.host(host)
    net.at(round(at_s * S), host.stop)
    if back_s is None:
        return
    if begin is not None:
        net.at(round(back_s * S), lambda: setattr(
            host, "software", lambda host: [Life(host, "node", begin)]))
    net.at(round(back_s * S), host.start)


def control(net, *kinds):
    """(time in s, source, destination, kind, bytes) of the middleware's own frames."""
    return [(time_ns / S, *rest) for time_ns, _, *rest in net.rows("control")
            if not kinds or rest[2] in kinds]


def beliefs(net):
    """(time in s, believer, other, topic, 1 or 0)."""
    return [(time_ns / S, *rest) for time_ns, _, *rest in net.rows("believes")]


def seen(net, by="b"):
    """(time in s, of whom, state) as one host sees the others."""
    return [(row[0] / S, row[3], row[4]) for row in net.rows("sees") if row[2] == by]


def master(net, host):
    """The registry of a host's master."""
    return net.graph.middleware.processes.masters[net.graph.host(host).index].registry
