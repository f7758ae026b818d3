"""Keys of layout files as labels and sentences of the app write them."""

UNCHANGED = ("phi e",)
"""Symbols of formulas, which are not capitalized, beside those of two letters or one."""


def key_words(key: str) -> str:
    """Returns a key as people write it: `drag_coefficient` is Drag coefficient, and
    `center_of_buoyancy` Centre of buoyancy, as the boxes have it."""
    text = key.replace("_", " ").replace("center", "centre")
    if len(text) <= 2 or text in UNCHANGED:
        return text
    return text[0].upper() + text[1:]
