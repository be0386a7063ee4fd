"""This node's locations for the tools of dynamic_reconfigure: rqt_reconfigure, `dynparam` and its Python client.

If dynamic_reconfigure is not installed, there is nothing for them, and the node works without it.
"""

from typing import Callable

from rosslt.messages import Scalar
from rosslt.node.callbacks import Callbacks
from rosslt.node.change.owner_interface import Owner


def serve(owner: Owner, background: Callbacks) -> Callable[[], None]:
    """Offer the locations of this node as the dynamic_reconfigure server `<node>/rosslt`.

    Returns:
        What to call when locations were created, dropped or changed; it does nothing if dynamic_reconfigure is not
        installed.
    """
    try:
        from rosslt.node.reconfigure.server import Server
    except ModuleNotFoundError as error:
        _check(error)
        return lambda: None
    return Server(owner, background).update


def reconfigure_parameter(node: str, parameter: str, value: Scalar) -> bool:
    """Give a parameter of a node a new value by its server of dynamic_reconfigure.

    Args:
        node: its full name.
        parameter: its name below that of the node.

    Returns:
        False if the node has no such server, or none of that parameter, or if dynamic_reconfigure is not installed.

    Raises:
        ValueError: it does not take that value, and has the former one.
    """
    try:
        from rosslt.node.reconfigure.client import set_parameter
    except ModuleNotFoundError as error:
        _check(error)
        return False
    return set_parameter(node, parameter, value)


def _check(error: ModuleNotFoundError) -> None:
    """Raise an error again that is not that dynamic_reconfigure is not installed."""
    if (error.name or '').split('.')[0] != 'dynamic_reconfigure':
        raise error
