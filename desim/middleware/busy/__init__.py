"""Hosts whose callbacks take time: the executors of their nodes, queues, timers, and memory."""
