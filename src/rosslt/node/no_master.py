"""Exceptions raised when the master is unreachable, has just been killed, or is no ROS master."""

import http.client
import xmlrpc.client
from xml.parsers.expat import ExpatError

import rosgraph

#: Includes those raised when an answer is cut off.
NO_MASTER = (OSError, http.client.HTTPException, rosgraph.MasterException, xmlrpc.client.Error, ExpatError)
