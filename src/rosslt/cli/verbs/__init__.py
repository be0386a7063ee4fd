"""The verbs of the command: a module each, with the names that `rosslt.cli.verb.Verb` lists."""
