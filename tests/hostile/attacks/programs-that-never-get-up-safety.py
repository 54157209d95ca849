# title: Plain programs of safety that sleep before they make their nodes
# exercise: safety
# base: right-callbacks
# told: it was not found out what
# score: 1

import sys
import threading

if "--program" in sys.argv:
    threading.Event().wait()
