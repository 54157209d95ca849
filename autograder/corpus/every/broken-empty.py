# title: An empty cell
# fails: the first

