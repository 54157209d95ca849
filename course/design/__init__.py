"""Designs: declare a robot's nodes and what connects them; they come up as real ROS 2 nodes.

``course.Design`` is the way in. What travels between the nodes of a design is dye: see
`message_tags`.
"""

from course.design.declaration import Design, NodeDeclaration
from course.design.endpoints import DesignError
from course.design.message_tags import carry

__all__ = ["Design", "DesignError", "NodeDeclaration", "carry"]
