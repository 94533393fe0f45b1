"""Computers that get busy: processors, their scheduling, and what callbacks and messages cost.

The nodes whose callbacks run on these processors, with their queues, timers and messages, are in
``desim.middleware.busy``.
"""
