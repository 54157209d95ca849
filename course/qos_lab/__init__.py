"""The QoS lab: predict what two profiles do together, then see it happen between two processes.

`bench` runs one experiment in processes of its own, so that a kernel stays as it was; `rules` says
what DDS promises; `lab` brings both together.
"""
