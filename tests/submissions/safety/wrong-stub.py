# title: the stub as it is released
# fails: the first
# in: the stub

