# title: A cell that never ends
# fails: everything
# seconds: 6

while True:
    pass
