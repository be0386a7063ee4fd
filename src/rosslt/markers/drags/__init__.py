"""Drags: which changes of sources a dragged handle requests, and what happens to them.

Like `scene`, nothing here knows of RViz: a view reports what a hand does (`Drags.move`, `Drags.release`). `drag` is one
drag, `changes` turns a wanted pose into changes of sources, `drop` looks whether a thing is shown where it was dropped,
and `wording` says in plain words what was refused.
"""
