"""ROS parameters: how they and locations are kept equal, and how a parameter is a source."""
