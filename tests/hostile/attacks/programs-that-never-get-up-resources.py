# title: Plain programs of resources that sleep before they make their nodes
# exercise: resources
# base: right-no-thread
# told: It took none.
# score: 6

import sys
import threading

if "--program" in sys.argv:
    threading.Event().wait()
