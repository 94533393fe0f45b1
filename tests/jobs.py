"""Jobs that need nothing but processors, and whole plays of them."""

from fractions import Fraction

from desim.computers.processors import Job, Processors
from desim.computers.scheduling import DISCIPLINES
from desim.engine.kernel import Kernel, Phase


class Play:
    """Jobs at given times on ``count`` processors. ``log`` has a line a begin and an end."""

    def __init__(self, discipline, count=1, speed=Fraction(1), kernel=None, entity=0):
        self.kernel = kernel or Kernel()
        chosen = DISCIPLINES[discipline] if isinstance(discipline, str) else discipline
        self.processors = Processors(self.kernel, entity, count, speed, chosen())
        self.log = []
        self.sojourn_ns = []
        self.jobs = 0

    def add(self, time_ns, name, work_ns, priority=0, awaited=True):
        job = Named(self, name, work_ns, priority, awaited)
        self.jobs += 1
        self.kernel.at(time_ns, Phase.NETWORK, self.jobs, job.arrive)
        return job

    def run(self, until_ns=10**18):
        self.kernel.run(until_ns)
        return self.log


class Named(Job):
    def __init__(self, play, name, work_ns, priority, is_awaited):
        super().__init__(priority)
        self.play, self.name, self.work_ns = play, name, work_ns
        self.is_awaited = is_awaited
        self.arrived_ns = 0

    def arrive(self, _):
        self.arrived_ns = self.play.kernel.now_ns
        self.play.processors.submit(self)

    def begin(self):
        self.play.log.append((self.play.kernel.now_ns, self.name, "begins"))
        self.awaited = self.is_awaited
        return self.work_ns

    def end(self):
        now_ns = self.play.kernel.now_ns
        self.play.log.append((now_ns, self.name, "ends"))
        self.play.sojourn_ns.append(now_ns - self.arrived_ns)


def ends(log):
    return [(time_ns, name) for time_ns, name, what in log if what == "ends"]
