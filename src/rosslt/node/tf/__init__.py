"""tf with provenance: broadcasters, a buffer whose lookups know where their numbers came from, and transforms.

`rosslt.tf` offers it to users. Nothing is imported here, so that a node without tf loads none of it.
"""
