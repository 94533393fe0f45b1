"""Runs that pause: a program goes to a time or to a robot's next decision, looks, acts, goes on."""

from desim.stepping.decisions import ControlPeriods, Decision, GoalDecision, Goals, Turns
from desim.stepping.stepper import Stepper

__all__ = ["ControlPeriods", "Decision", "GoalDecision", "Goals", "Stepper", "Turns"]
