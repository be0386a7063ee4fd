"""What the tests do with processes, where it may go wrong unseen."""

import threading
from xmlrpc.server import SimpleXMLRPCServer

import pytest
import rosgraph

from support.masters import reached_master
from support.processes import forget_node, wait_until


@pytest.mark.rostest
def test_the_master_calls_no_server_of_a_forgotten_node(tmp_path):
    called = []
    with reached_master(tmp_path / 'log'), SimpleXMLRPCServer(('localhost', 0), logRequests=False) as server:
        server.register_function(lambda _, key, __: called.append(key) or [1, '', 0], 'paramUpdate')
        server.register_function(lambda *_: called.append('shutdown') or [1, '', 0], 'shutdown')
        threading.Thread(target=server.serve_forever, daemon=True).start()
        master = rosgraph.Master('/test')
        rosgraph.Master('/gone/rosslt').subscribeParam('http://localhost:%d/' % server.server_address[1], '/gone')
        master.setParam('/gone/x', 1)
        wait_until(lambda: called == ['/gone/x/'], 'it hears of its parameter')
        forget_node('/gone')
        wait_until(lambda: called[1:] == ['shutdown'], 'the master takes leave of it')
        rosgraph.Master('/other').subscribeParam('http://localhost:%d/' % server.server_address[1], '/after')
        master.setParam('/gone/x', 2)
        master.setParam('/after', 3)
        wait_until(lambda: called[2:], 'the one that is subscribed hears')
        assert called[2:] == ['/after/']
        server.shutdown()
