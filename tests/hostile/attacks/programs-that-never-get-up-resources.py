# title: Plain programs of resources that sleep before they make their nodes
# exercise: resources
# base: right-no-thread
# told: it was not run once more
# score: any

import sys
import threading

if "--program" in sys.argv:
    threading.Event().wait()
