"""The room of the page: a scene and its handles in a browser, a field for each location, and where numbers come from.

It may import the rooms `markers`, `node`, `messages`, `files` and `values`, and rospy. It is made with viser, which
nothing else needs: without it, this module cannot be imported. Its door is `run`, which shows the page until the node
is shut down.
"""

from rosslt.web.access import NotServed
from rosslt.web.page import Page, run
