"""The whole evaluation as one page: experiments give rows, rows tables, and those the page."""
