# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Chapter 6: Python rclpy - Nodes That Others Can Set, and That Keep Time
#
# A node of chapter 5 does what its code says, for ever. On a robot somebody wants to turn a knob:
# slower, please, and not while I am working on the wheels. This chapter is about the four parts of
# `rclpy` that make a node fit for that: parameters, timers, executors and callback groups.
#
# Run the cells from top to bottom with **Shift+Enter**.

# %% tags=["notebook-only"]
# %load_ext course
import course

session = course.session(threads=4)

# %% [markdown]
# ## Parameters
#
# A **parameter** is a named value of a node that others can read and set while it runs. A node
# *declares* each one, with a default, whose type is the parameter's from then on.

# %%
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from std_msgs.msg import Int32


class Blinker(Node):
    """Blinks as often as its parameter says."""

    def __init__(self):
        super().__init__('blinker')
        about = ParameterDescriptor(description='Blinks a second')
        self.declare_parameter('rate', 2.0, about)
        self.lamp = self.create_publisher(Int32, 'lamp', 10)
        self.count = 0
        self.timer = self.create_timer(1.0 / self.get_parameter('rate').value, self.blink)

    def blink(self):
        self.count += 1
        self.lamp.publish(Int32(data=self.count))


blinker = course.run(Blinker)

# %% [markdown]
# From outside it looks like this. The description is all that an operator has to go by.

# %%
# %ros param describe /blinker rate

# %%
# %ros param set /blinker rate 5.0

# %% [markdown]
# It said yes, and blinks on at 2 Hz: nobody has told its timer. A node that wants to know of a
# change registers a callback. There are two that matter, and they come in this order:
#
# 1. `add_on_set_parameters_callback` is asked **before** anything has changed, and may say no, with
#    a reason. It must not act on the value: another callback may still refuse it.
# 2. `add_post_set_parameters_callback` is told **after** the change.


# %%
class ObedientBlinker(Blinker):
    """Follows its parameter, and refuses what does no good."""

    def __init__(self):
        super().__init__()
        self.add_on_set_parameters_callback(self.check)
        self.add_post_set_parameters_callback(self.follow)

    def check(self, parameters):
        for parameter in parameters:
            if parameter.name == 'rate' and not 0.5 <= parameter.value <= 20.0:
                return SetParametersResult(successful=False, reason='rate is 0.5 to 20 Hz')
        return SetParametersResult(successful=True)

    def follow(self, parameters):
        self.destroy_timer(self.timer)
        self.timer = self.create_timer(1.0 / self.get_parameter('rate').value, self.blink)


blinker = course.run(ObedientBlinker)

# %%
# %ros param set /blinker rate 0.0

# %% [markdown]
# ## Timers
#
# A **timer** calls a function again and again, by a clock of the node. That clock is not always the
# one on the wall: in a simulation, or when a recording is played, a robot's time runs faster or
# slower, and may stand still. `time.sleep` knows nothing of that; a timer does.
#
# | | What happens |
# | --- | --- |
# | `create_timer(0.5, f)` | `f` is called every half second, for the first time after half a second |
# | `timer.cancel()` | no more calls, until |
# | `timer.reset()` | a new period begins now |
# | `destroy_timer(timer)` | it is gone |

# %%
with course.Session(sim_time=True) as robot:
    robot.run(ObedientBlinker)
    lamp = robot.record('/lamp')
    robot.sim.advance(10.0)  # ten seconds of the robot's time, in no time
    robot.until(lambda: len(lamp) >= 20, timeout=5.0)
    print(f'{len(lamp)} blinks in 10 seconds')

# %% [markdown]
# ## Executors
#
# Callbacks do not run by themselves. An **executor** waits until something is ready, such as a
# timer, a message or an answer, and calls the function that belongs to it, on one of its threads.
# With a single thread, one slow callback holds up all others.

# %% [markdown]
# ## Callback groups
#
# With several threads, **callback groups** say what may run side by side. Callbacks of one
# *mutually exclusive* group never do, also if threads are idle, and a node's callbacks are all in
# one such group unless it says otherwise. Callbacks of a *reentrant* group may all run at once, and
# each of them several times: then what they share needs a lock.

# %% [markdown]
# ## Now you
#
# 1. [Parameters and timers](ch06/parameters.ipynb): a robot's heartbeat that an operator can set.
# 2. [Executors and callback groups](ch06/executors.ipynb): a safety loop that slow work on the same
#    node must not hold up.

# %% tags=["notebook-only"]
course.close()
