"""The finlab app in the browser: a robot whose fins move as they are allocated.

What a browser shows is one `Session` (no viser in it). An event becomes an intent, the session checks it and
changes, a worker solves the newest question, `board.py` says what there is to show and writes what of it
has changed. All sessions and widgets belong to viser's event loop; only solving
happens elsewhere.

`session` is what one browser has made, `tasks` what is worked out in the background, `scene` the 3D view,
`panels` the widgets beside it, `markup` the HTML and the sentences in them.
"""
