"""What an exam is written with: the nouns of a task, a node under examination, and its findings.

The door for exercises:

    from autograder.observe import Parameter, Service, Topic, one_node
"""

from autograder.observe.actions import ActionServerEnd as ActionServerEnd
from autograder.observe.actions import SentGoal as SentGoal
from autograder.observe.clock_bound_node import ClockBoundNode as ClockBoundNode
from autograder.observe.clock_bound_node import WallWait as WallWait
from autograder.observe.heartbeats import longest_silence as longest_silence
from autograder.observe.heartbeats import require_heartbeat as require_heartbeat
from autograder.observe.multi_node_rig import Nodes as Nodes
from autograder.observe.multi_node_rig import several_nodes as several_nodes
from autograder.observe.nouns import Action as Action
from autograder.observe.nouns import Parameter as Parameter
from autograder.observe.nouns import Service as Service
from autograder.observe.nouns import Task as Task
from autograder.observe.nouns import Topic as Topic
from autograder.observe.observed_goal import ObservedGoal as ObservedGoal
from autograder.observe.observed_node import STRIDE_S as STRIDE_S
from autograder.observe.observed_node import ObservedNode as ObservedNode
from autograder.observe.observed_node import one_node as one_node
from autograder.observe.plain_programs import Clocked as Clocked
from autograder.observe.plain_programs import ObservedProgram as ObservedProgram
from autograder.observe.plain_programs import ProgramEnded as ProgramEnded
from autograder.observe.program_trials import Bounds as Bounds
from autograder.observe.program_trials import NodeTrials as NodeTrials
from autograder.observe.program_trials import served as served
from autograder.observe.services import Request as Request
from autograder.observe.services import ServiceServer as ServiceServer
