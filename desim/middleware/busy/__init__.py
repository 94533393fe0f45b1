"""Hosts whose computer gets busy: executors, queues of callbacks, timers, and memory."""
