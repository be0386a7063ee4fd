"""The verbs of the command, a module each: DESCRIPTION, EXAMPLE, `parse(parser)` and `run(options)`, which returns the
exit code, or None for 0."""
