"""Batches: messages that one host publishes in one instant to many receivers, handled as one.

A driver publishes the scans of a whole fleet at once; a robot sends its pose to all others ten
times a second. Each reception would be a frame of its own and an arrival of its own; nearly all are
read much later or never. Here they are one ``Batch``: the network model is asked once for all
arrivals, a message is made when somebody reads it, and trace rows and counts are written later,
many batches at once.

A batch has a *place* for each reception. The same place in all batches of a publisher is a
``Member``, which stands in for the link to one receiver. A message has *landed* when the time of
its arrival is past, noticed or not. Messages set out in a batch while all links are at rest and no
rule touches them, else one by one. If the network loses a frame, or a host stops, ``Member.give``
returns messages that are on their way to their links. The trace has the same rows either way.
"""
