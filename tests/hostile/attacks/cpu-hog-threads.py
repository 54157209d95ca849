# title: A hundred threads that never rest
# told: it kept more than 12 processes and threads busy

import hashlib
import threading

data = bytes(2**20)


def work():
    while True:
        hashlib.sha256(data)  # lets the other threads run


for _ in range(100):
    threading.Thread(target=work, daemon=True).start()
work()
