"""Zenoh as rmw_zenoh uses it: a router on each host, links between routers, messages over these.

One process per host: the sessions of a host's nodes are one with its router, which costs nothing.
"""
