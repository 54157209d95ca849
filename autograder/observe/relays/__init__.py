"""Nodes that relay messages, looked at in wall time: what goes in, and what comes out.

| module | what it shows |
| --- | --- |
| `observed_relays` | the student's nodes: plays the source, and hears every topic on the way |
| `relay_path`, `marks` | one kind of message on its way, known again by its mark |
| `arrivals` | which messages arrived at one end, in what order, and when |
| `message_stream` | messages that are published at a rate |
| `relay_latency` | whether a node passes each message on at once |
| `slow_reader` | what a consumer that was busy finds in its queues |
| `consumer_lag` | whether a consumer keeps up, or falls further and further behind |
"""
