"""What asking a master raises that is not there, has just been killed, or is something else."""

import http.client
import xmlrpc.client
from xml.parsers.expat import ExpatError

import rosgraph

#: Also where the answer broke off in its middle.
NO_MASTER = (OSError, http.client.HTTPException, rosgraph.MasterException, xmlrpc.client.Error, ExpatError)
