"""Designs: declare a robot's nodes and what connects them; they come up as real ROS 2 nodes.

``course.Design`` is the way in. What travels between the nodes of a design that runs is dye: see
`message_tags`. What they do when they drive a robot is in `at_work`.
"""

from course.design.declaration import Design
from course.design.endpoints import DesignError
from course.design.message_tags import carry
from course.design.node_declaration import NodeDeclaration

__all__ = ["Design", "DesignError", "NodeDeclaration", "carry"]
