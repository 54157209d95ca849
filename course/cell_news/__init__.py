"""What a notebook says under a cell that has run: errors explained, and news of nodes.

`errors` explains what a cell raised, `session_news` tells what nodes did meanwhile, and
`spin_watch` speaks while a cell blocks; `news` is how any of it is shown.
"""
