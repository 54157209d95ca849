"""Live views: what happens on the session's nodes, shown beside the cell that caused it.

A view reads a plain model (`course.graph`, say), turns it into a frame of JSON data for the
browser, and has the same in words. `shared` has what all views share; the browser's part of each is
a script in ``static``, which knows nothing of ROS.
"""
