"""The ROS graph as plain data: read from DDS, compared, and written out as text or Mermaid.

Nothing here knows of widgets, and the model knows nothing of ROS either: `reader` fills it.
"""
