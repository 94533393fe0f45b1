"""A message: topic, size in bytes, content."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from desim.middleware.contents import Content, Lazy

if TYPE_CHECKING:
    from desim.middleware.host import Host
    from desim.middleware.topics import Topic


class Message:
    """A message of a node. ``seq`` counts the messages of its host; ``number`` counts the messages
    between hosts of the whole run (0: it never left its host) and is in no digest. ``unread`` is
    the content as it was published, to be passed on. ``content`` is the same; if that is ``Lazy``,
    the message becomes a ``LazyMessage``."""

    __slots__ = ("origin", "about", "seq", "size_bytes", "born_ns", "number", "unread")

    content: Any

    def __init__(self, origin: Host, about: Topic, seq: int, size_bytes: int, born_ns: int,
                 content: Content) -> None:
        self.origin = origin
        self.about = about
        self.seq = seq
        self.size_bytes = size_bytes
        self.born_ns = born_ns
        self.number = 0
        self.unread = content
        if type(content) is Lazy:
            self.__class__ = LazyMessage

    @property
    def source(self) -> int:
        """Index of the host that published it."""
        return self.origin.index

    @property
    def stamp_ns(self) -> int:
        """The time of its publication, by the clock of its host."""
        clock = self.origin.clock
        return self.born_ns if clock is None else clock.read(self.born_ns)

    @property
    def topic(self) -> str:
        """Absolute name."""
        return self.about.name


# One place with two names, as a property would be a call.
Message.content = Message.unread  # type: ignore[misc] # the descriptor of the slot


class LazyMessage(Message):
    """A message whose content is computed when it is first read."""

    __slots__ = ()

    unread: Lazy

    @property
    def content(self) -> object:
        unread = self.unread
        if unread.compute is not None:
            unread.value = unread.compute(*unread.about)
            unread.compute, unread.about = None, ()
        return unread.value
