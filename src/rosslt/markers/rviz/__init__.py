"""Interactive markers: a scene shown in RViz, and what RViz reports of hands on it.

`display` keeps RViz's markers in step with the scene, by the `server`; `controls` draws a handle, `menus` are what a
right click opens, `notes` are texts beside handles, and `node` is `slt_visualization` itself.
`configuration` opens RViz with everything that can be dragged, and with the `robot` if one is.
"""
