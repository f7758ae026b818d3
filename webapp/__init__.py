"""The finlab app in the browser: a robot whose fins move as they are allocated.

What a browser shows is one `Session` (no viser in it). `view.py` is the loop of one browser: an
event becomes an intent (`intents.py`), the session checks it and changes, what can be seen is asked
(`tasks/jobs.py`), threads answer (`tasks/slot.py`), and widgets are functions of the facts of
session and answers (`facts.py`, `board.py`): what did not change is not sent. All sessions and
widgets belong to viser's event loop; only solving happens elsewhere.

`session` is what one browser has made, `tasks` what is worked out in the background, `scene` the 3D
view, `panels` the widgets beside it, `markup` the HTML and the sentences in them.
"""
