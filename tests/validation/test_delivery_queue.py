"""One picker as one repairman: within 3 % of theory, and not where the model is another one."""

import pytest

from desim.monitor.tasks.delivery import Deliveries
from desim.ports.delivery import ServiceEnd
from desim.validation import delivery
from desim.validation.delivery import MachinesOfOneRepairman, machines_at_one_repairman


def failing():
    return [check.what for check in MachinesOfOneRepairman().checks(None) if not check.holds]


def test_theory_by_hand():
    """One machine: a cycle of 60 s and 20 s. Two: p0 = 1 / (1 + 2/3 + 2/9) = 9/17."""
    assert machines_at_one_repairman(1, 60.0, 20.0) == pytest.approx(1 / 80)
    assert machines_at_one_repairman(2, 60.0, 20.0) == pytest.approx(8 / 17 / 20)
    assert machines_at_one_repairman(100, 60.0, 20.0) == pytest.approx(1 / 20)


def test_a_picker_is_a_repairman():
    assert failing() == []


@pytest.mark.parametrize("factor", [0.92, 1.08])
def test_a_picker_of_another_speed_is_none(monkeypatch, factor):
    """8 % of the service move the throughput of eight robots by nearly as much."""
    lasts_ns = Deliveries._lasts_ns
    monkeypatch.setattr(Deliveries, "_lasts_ns",
                        lambda self, visit: round(factor * lasts_ns(self, visit)))
    assert {"8 robots, travel fixed", "8 robots, travel exponential"} <= {*failing()}


def test_a_picker_that_serves_all_at_once_is_none(monkeypatch):
    """Without a queue throughput grows in proportion to the robots."""
    def lasts_at_once(self, context, visit):
        self.begun += 1
        context.after(self._lasts_ns(visit), lambda _: self._ended(visit, ServiceEnd.DONE))

    monkeypatch.setattr(delivery, "_ORDERS", 2000)
    monkeypatch.setattr("desim.monitor.delivery.stations.ServiceQueue.join", lasts_at_once)
    assert len(failing()) >= 4
