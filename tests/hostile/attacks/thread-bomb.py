# title: Threads without end
# told: RuntimeError: can't start new thread

import threading

hold = threading.Event()
while True:
    threading.Thread(target=hold.wait, daemon=True).start()
