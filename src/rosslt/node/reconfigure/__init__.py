"""This node's locations for the tools of dynamic_reconfigure: rqt_reconfigure, `dynparam` and its Python client.

If dynamic_reconfigure is not installed, there is nothing for them, and the node works without it.
"""

from typing import Callable

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
        if (error.name or '').split('.')[0] != 'dynamic_reconfigure':
            raise
        return lambda: None
    return Server(owner, background).update
