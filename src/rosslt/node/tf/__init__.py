"""tf with provenance: broadcasters, a buffer whose lookups know where their numbers came from, and transforms.

`rosslt.tf` offers it to users. Nothing is imported here, so that a node without tf loads none of it.
"""

from typing import Any, Dict


def counterparts() -> Dict[str, Any]:
    """The classes that replace those of tf2_ros with the same names: {name: class}."""
    from rosslt.node.tf.broadcasters import StaticTransformBroadcaster, TransformBroadcaster
    from rosslt.node.tf.buffer import Buffer
    from rosslt.node.tf.listener import TransformListener

    classes = (Buffer, StaticTransformBroadcaster, TransformBroadcaster, TransformListener)
    return {one.__name__: one for one in classes}


def functions() -> Dict[str, Any]:
    """The functions that stand for those of tf2_geometry_msgs with the same names: {name: function}."""
    from rosslt.node.tf import transforms

    return {name: thing for name, thing in vars(transforms).items() if name.startswith('do_transform_')}
