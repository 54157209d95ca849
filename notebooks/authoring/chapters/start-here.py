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
# # ROS 2 in a notebook: start here
#
# 1. Open the first chapter, [ch05-building-blocks.ipynb](ch05-building-blocks.ipynb), and run its
#    first cell with **Shift+Enter**: there is a robot in it, and you drive. It has seven parts; most
#    cells leave something for you to change, and say at once whether it did what you meant. Running
#    a cell again is always safe.
# 2. Do its five exercises in the folder `ch05`, in the file browser on the left. Their check cells
#    tell you what your nodes do, what they should do, and why it matters on a robot.
# 3. Take its quiz, [ch05-quiz/quiz.ipynb](ch05-quiz/quiz.ipynb), as often as you like.
# 4. Go on with the next chapter, [ch06-python-rclpy.ipynb](ch06-python-rclpy.ipynb).
#
# If nothing arrives, `session.diagnose()` says why; if the course itself does not run, type
# `course doctor` in a terminal.
#
# ## Where you are
#
# This is how far you were when you started `course lab`. Run the cell again whenever you want to
# know: it takes a second.

# %% tags=["progress"]
import course

course.progress()

# %% [markdown]
# It counts the chapters' cells that have run, what the check cells have found, whether your
# explanations are written (save the notebook first), and your attempts at the quiz. It stands in
# the file `progress.json` in this folder and in your notebooks, and nowhere else.
