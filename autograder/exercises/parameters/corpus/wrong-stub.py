# title: The stub as it was handed out
# fails: node_starts
# says: node_starts: There is no service /heartbeat/pause.
# points: 0
# in: the stub
