"""Checks of what middlewares return. Each complaint names the plug-in."""

from __future__ import annotations

from desim.errors import ModelError, class_of
from desim.ports.middleware import Advertisement, CarriesMessages, Endpoint, Middleware, Transport


def transport_of(middleware: CarriesMessages, advertised: Advertisement) -> Transport:
    """The transport of a middleware for an advertised. Raises ``ModelError`` unless it is one."""
    transport = middleware.transport(advertised)
    missing = [f"{name}()" for name in ("connect", "send", "close", "waiting")
               if not callable(getattr(transport, name, None))]
    if missing:
        raise ModelError(f"{class_of(middleware)} gave the transport {transport!r} for "
                         f"{advertised.publisher.topic}, which has no {', '.join(missing)}")
    return transport


def subscribers_of(middleware: Middleware, publisher: Endpoint) -> tuple[Endpoint, ...]:
    """The subscribers that a middleware names for a publisher. Raises ``ModelError`` unless they
    are endpoints."""
    found = middleware.subscribers(publisher)
    if not isinstance(found, tuple | list) or not all(isinstance(end, Endpoint) for end in found):
        raise ModelError(f"{class_of(middleware)} gave {found!r} for the subscribers of "
                         f"{publisher.topic}; wanted: a tuple of endpoints")
    return found
