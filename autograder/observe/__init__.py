"""What an exam is written with: the nouns of a task, a node under examination, and its findings.

The door for exercises:

    from autograder.observe import Parameter, Service, Topic, one_node
"""

from autograder.observe.graph import GraphService as GraphService
from autograder.observe.graph import GraphTopic as GraphTopic
from autograder.observe.graph import RosGraph as RosGraph
from autograder.observe.graph_faults import find_link_faults as find_link_faults
from autograder.observe.graph_reader import GraphReader as GraphReader
from autograder.observe.nouns import Action as Action
from autograder.observe.nouns import Parameter as Parameter
from autograder.observe.nouns import Service as Service
from autograder.observe.nouns import Topic as Topic
from autograder.observe.observed_node import ObservedNode as ObservedNode
from autograder.observe.observed_node import one_node as one_node
