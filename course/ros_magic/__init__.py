"""``%ros``: the habits of the ROS 2 command line, in a notebook, on the session's own domain.

Each module has the commands of one noun (``%ros topic ...``); `arguments` says what they take.
"""
