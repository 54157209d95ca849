# title: The stub with a line that prints, and a comment
# fails: as the stub
# in: the stub
print("I have looked at it.")  # more tomorrow
