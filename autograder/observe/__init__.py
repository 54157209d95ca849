"""What an exam is written with: the nouns of a task, a node under examination, and its findings.

The door for exercises:

    from autograder.observe import Parameter, Service, Topic, one_node
"""

from autograder.observe.choices import Choices as Choices
from autograder.observe.choices import Question as Question
from autograder.observe.findings import in_context as in_context
