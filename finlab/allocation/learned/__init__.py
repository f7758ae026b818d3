"""The learned methods: a network proposes, a search in force space and a refinement do the rest."""
