"""Batches: messages that one host publishes in one instant to many receivers, handled as one.

A driver publishes the scans of a whole fleet at once; a robot tells its pose to all others ten
times a second. Each reception would be a frame of its own and an arrival of its own; nearly all are
read much later or never. Here they are one ``Batch``: the network model is asked once for all
arrivals, a message is made when somebody reads it, and trace rows and counts are written later,
many batches at once.

A batch has a *place* for each reception. A link at rest lends itself: while nothing else happens to
it, its messages go in batches. All unusual cases go message by message: a rule that affects the
frame, a link whose last message has not arrived, a frame that is lost, a host that stops. The trace
has the same rows either way.
"""
