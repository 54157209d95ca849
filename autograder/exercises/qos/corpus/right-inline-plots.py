# title: Plots above the answer, a task that goes on beside it, widgets that nobody moves
# fails: nothing
# in: the stub
%matplotlib inline
import asyncio

import ipywidgets
import matplotlib.pyplot as plt
from IPython.display import clear_output, display

plt.plot([30, 20, 200, 5])
plt.ylabel("messages a second")

out = ipywidgets.Output()
display(out, ipywidgets.IntSlider(description="depth"))
with out:
    print("what the profiles promise")


async def count():
    global counted
    for counted in range(1000):
        await asyncio.sleep(0.001)


counted = 0
counting = asyncio.create_task(count())
await asyncio.sleep(0.01)
assert counted
display(get_ipython().kernel.session.session[:0])
clear_output(wait=True)

camera_qos = QoSProfile(reliability=ReliabilityPolicy.BEST_EFFORT, depth=5)
lidar_qos = QoSProfile(reliability=ReliabilityPolicy.RELIABLE, depth=1)
imu_qos = QoSProfile(reliability=ReliabilityPolicy.RELIABLE, depth=10)
stop_qos = QoSProfile(
    reliability=ReliabilityPolicy.RELIABLE,
    history=HistoryPolicy.KEEP_ALL,
)
