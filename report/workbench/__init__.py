"""The workbench: a page in the browser on which effects and parameters are moved by hand, and FRFs and errors follow.

============  ====================================================================================================
state         what is set, undo and redo, the ladder of steps that were kept: frozen values and pure functions
bench         what is computed at a setting: FRFs, errors by mode and test, modes, fits to these errors
lines         the effects of a setting fitted to the FRF lines and weighed, as `spindle diagnose` does
section       the section as polygons that move with their bodies
explanations  explanations with their probabilities, from a diagnosis read or made here
save          scene, report, and the script that does the same without the page
shades        the colours of the map of errors, on a light page and on a dark one
plots         FRFs, the map of errors and the moving section as Bokeh figures
words         what the page says in words and tables
controls      a slider for every parameter and tolerance
work          a task beside the page: its progress, its end, how it is stopped
page          one tab: it shows a session and turns what a user does into actions on it
server        the page served on the loopback interface, under a token
============  ====================================================================================================

Bokeh serves and draws it, because everything that changes is computed in Python: its server keeps a document in Python and in the browser the same
over a websocket, with callbacks in Python for sliders and figures that take new columns without being made again. It is BSD-3, released since 2013,
serves its own scripts (no network is needed), refuses foreign origins, and brings four packages that are not here already (tornado, narwhals, xyzservices,
PyYAML; 45 MB, where Rerun takes 200). Dash and Streamlit run a callback by an HTTP request each, Panel is Bokeh with more on top, and
Rerun's viewer has no controls: what was measured and computed stands there when `spindle compare --out` is asked for a log. It is imported by the verb alone.
"""
