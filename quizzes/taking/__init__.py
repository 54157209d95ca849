"""A quiz as a learner takes it: answer, submit, see what was right, try another one."""
