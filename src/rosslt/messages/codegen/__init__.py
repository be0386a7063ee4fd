"""Code that is written and compiled once for each message class.

`walkers` are for any class, `leaf_access` is for simple ones; `blanks` makes empty messages.
"""
