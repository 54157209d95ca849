"""ROS domains: a free one is leased, others on this machine are found, and ports cleaned up."""
