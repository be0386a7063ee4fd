"""Topics and services: rospy's, carrying provenance."""
