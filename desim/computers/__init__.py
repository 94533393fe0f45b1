"""Computers that get busy: processors and their scheduling, memory, and the costs of callbacks.

The nodes whose callbacks run on these processors, with their queues, timers and messages, are in
``desim.middleware.busy``.
"""
