"""What an exam is written with: the nouns of a task, a node under examination, and its findings.

The door for exercises:

    from autograder.observe import Parameter, Service, Topic, one_node
"""

from autograder.observe.choices import Choices as Choices
from autograder.observe.choices import Question as Question
from autograder.observe.findings import in_context as in_context
from autograder.observe.nouns import Action as Action
from autograder.observe.nouns import Parameter as Parameter
from autograder.observe.nouns import Service as Service
from autograder.observe.nouns import Topic as Topic
from autograder.observe.observed_node import ObservedNode as ObservedNode
from autograder.observe.observed_node import one_node as one_node
