# title: Plain programs of resources that sleep before they make their nodes
# exercise: resources
# base: right-no-thread
# told: It took none.
# score: 10

import sys
import threading

if "--program" in sys.argv:
    threading.Event().wait()
