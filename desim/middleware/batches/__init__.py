"""Batches: messages that one host publishes in one instant to many receivers, handled as one.

A driver publishes the scans of a whole fleet at once; a robot sends its pose to all others ten
times a second. Each reception would be a frame of its own and an arrival of its own; nearly all are
read much later or never. Here they are one ``Batch``: the network model is asked once for all
arrivals, a message is made when somebody reads it, and trace rows and counts are written later,
many batches at once.

A batch has a *place* for each reception. The same place in all batches of a publisher is a
``Member``: the link to one receiver. A message has *landed* when the time of its arrival is past,
noticed or not. While nothing else happens to a link at rest, its messages go in batches. In an
unusual case the batch *gives* a message back to its link: a rule affects the frame, the link's last
message has not arrived, the frame is lost, a host stops. The trace has the same rows either way.
"""
