"""What the tests of the app share: the process that is copied to read files is ready."""

from finlab.files.worker import prepare

prepare(["webapp.session.files", "webapp.tasks.fitting"])
