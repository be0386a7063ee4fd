"""The scene: what the watched topics show, which handles that gives, and what a drag of each would ask for.

Nothing here knows of RViz's interactive markers: `rosslt.markers.rviz` shows a scene there, and any other view, a
page in a browser for example, shows the same one. `topics` subscribes, `scene` keeps the handles up to date and tells
its views, `by_type` and `marker` say which handles follow from a message, and `handles` what they are.
"""
