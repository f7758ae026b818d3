"""Work away from the event loop: answers, searches, swims, and the threads they run on."""
