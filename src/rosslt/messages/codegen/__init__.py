"""Code that is written and compiled once for each message class: `walkers` for any, `leaf_access` for simple ones."""
