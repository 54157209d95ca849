"""The QoS lab: predict what two profiles do together, then see it happen between two processes.

`experiment_runner` runs one experiment in processes of its own, so that a kernel stays as it was;
`rules` says what DDS promises; the view `course.views.qos_lab` brings both together.
"""
