# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown] nbgrader={"grade": false, "grade_id": "quiz-about", "locked": true, "schema_version": 3, "solution": false}
# # Knowledge check: the building blocks of ROS 2
#
# Five questions on chapter 5. You pass with four of them fully right, and you can try as often as
# you like: each new attempt asks other questions about the same five ideas. What counts is the best
# of your first 20 attempts; what comes after them is practice, and your instructor has a look at it.
# One attempt takes about 10 minutes.
#
# Run the next cell. Nothing is marked before you press *Submit answers*; then you see for each
# answer what is right about it and, where it is not, what really happens, with code that shows it
# on live nodes. Everything works with the keyboard alone: Tab goes from control to control, the
# arrow keys choose among options, Space ticks and presses.
#
# Your answers are saved as you give them. If the quiz is not there, says *model not found* or does
# not respond, the kernel was restarted: run the cell again, and it goes on where you were.

# %% nbgrader={"grade": false, "grade_id": "quiz-questions", "locked": true, "schema_version": 3, "solution": false}
import quizzes

quiz = quizzes.load("ch05")
quiz.show()

# %% [markdown] nbgrader={"grade": false, "grade_id": "quiz-counts", "locked": true, "schema_version": 3, "solution": false}
# ## See it happen
#
# Once you have submitted, `quiz.demo(2)` puts the code that belongs to question 2 into a new cell,
# ready to run.
#
# ## What you hand in
#
# The quiz keeps your attempts in the file `quiz-ch05.attempts.jsonl` beside this notebook. Hand in
# both: your instructor marks the answers in that file again, one point for each question, with
# part of a point for an answer that is partly right. The next cell shows your best attempt so far.

# %% nbgrader={"grade": true, "grade_id": "quiz-ch05", "locked": true, "points": 0, "schema_version": 3, "solution": false}
quiz.points()
