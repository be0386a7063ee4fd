"""A signal's handler may publish in the middle of a publish, as `on_shutdown` does where a node stops its robot."""

import threading

from rosslt.messages.codec.bounded_cache import BoundedCache


class Interrupted(dict):
    """A dict that calls a function while the first value is put into it, as a signal's handler may be called."""

    def __init__(self, handler):
        super().__init__()
        self.handlers = [handler]

    def __setitem__(self, key, value):
        while self.handlers:
            self.handlers.pop()()
        super().__setitem__(key, value)


def ends(function):
    thread = threading.Thread(target=function, daemon=True)
    thread.start()
    thread.join(30)
    return not thread.is_alive()


def test_a_publish_in_the_middle_of_another_one_ends_where_something_is_kept_for_the_next_one():
    cache = BoundedCache(2)
    cache._values = Interrupted(lambda: cache.put('stop', 0.0))
    assert ends(lambda: cache.put('go', 1.0))
    assert (cache.get('stop'), cache.get('go')) == (0.0, 1.0)
