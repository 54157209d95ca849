"""What an exam is written with: the nouns of a task, a node under examination, and its findings.

The door for exercises:

    from autograder.observe import Parameter, Service, Topic, one_node

What only some exams need, they import from its own module, such as
`autograder.observe.lifecycle.lifecycle_manager`: then a change of it concerns the verdicts of these
exams alone. `python -m autograder.observe` prints all of it.
"""

from autograder.examination.draws import Draws as Draws
from autograder.observe.nouns import Action as Action
from autograder.observe.nouns import Parameter as Parameter
from autograder.observe.nouns import Service as Service
from autograder.observe.nouns import Task as Task
from autograder.observe.nouns import Topic as Topic
from autograder.observe.observed_node import Change as Change
from autograder.observe.observed_node import ObservedNode as ObservedNode
from autograder.observe.observed_node import one_node as one_node
from autograder.observe.span import Span as Span
