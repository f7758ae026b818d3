"""The whole evaluation as one page: jobs give records, records tables and pictures, and those the page."""
