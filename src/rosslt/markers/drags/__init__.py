"""Drags: which changes of sources a dragged handle requests, and what happens to them.

Like `scene`, nothing here knows of RViz: a view reports what a hand does to `scene_drags` (`Drags.move`,
`Drags.release`), which sends the changes. `drag` is one drag, `changes` turns a wanted pose into changes of sources,
`drop_check` checks that a dropped thing is shown where it was dropped, and `wording` says what was refused.
"""
