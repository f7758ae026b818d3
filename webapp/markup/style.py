"""The one style sheet of all markup, with the colours of the theme as variables."""

from importlib.resources import files

from webapp.theme import ASKED, DELIVERED, MISSING, css

_VARIABLES = (
    f":root {{ --fl-asked: {css(ASKED)}; --fl-delivered: {css(DELIVERED)}; --fl-missing: {css(MISSING)}; }}"
)
STYLE = f"<style>{_VARIABLES}{files('webapp.markup').joinpath('style.css').read_text('utf-8')}</style>"
"""A style element, to be put into the page once."""
