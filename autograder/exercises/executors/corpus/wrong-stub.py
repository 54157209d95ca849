# title: The stub as it was handed out
# fails: guard_starts
# says: guard_starts: There is no publisher on /safety/beat
# points: 0
# in: the stub
