"""Pages that follow another one: who shows to whom, by codes. All belongs to the event loop."""

import secrets
from typing import NamedTuple

from finlab.errors import FinlabError
from webapp.session import Session
from webapp.session.following import Follower, Scene
from webapp.tasks.context import Context

LETTERS = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"
"""Signs of a code: none is taken for another one."""
CODE_LENGTH = 6
"""Signs of a code; it is read aloud."""


class Lecture:
    """A session that others may follow."""

    def __init__(self, code: str, session: Session) -> None:
        self.code = code
        self.session = session
        self.is_open = True
        """Whether its page is there."""
        self.followers: list[Following] = []
        """Pages that follow it."""
        self.teacher: Following | None = None
        """The page that shows it."""

    def tell(self) -> None:
        """What is shown has changed, or may have."""
        for follower in self.followers:
            follower.ring()

    def count(self) -> None:
        """Another page follows, or does no longer."""
        if self.teacher is not None:
            self.teacher.ring()


class Lectures:
    """All sessions of a server that may be followed."""

    def __init__(self) -> None:
        self._by_code: dict[str, Lecture] = {}

    def of(self, session: Session) -> Lecture | None:
        """The lecture of a session; None where it may not be followed."""
        for lecture in self._by_code.values():
            if lecture.session is session:
                return lecture
        return None

    def begin(self, session: Session) -> Lecture:
        """Lets a session be followed; one that is followed already keeps its code."""
        lecture = self.of(session)
        if lecture is None:
            code = ""
            while not code or code in self._by_code:
                code = "".join([secrets.choice(LETTERS) for _ in range(CODE_LENGTH)])
            lecture = self._by_code[code] = Lecture(code, session)
        return lecture

    def find(self, code: str) -> Lecture:
        """The lecture of a code, in any case and with spaces.

        Raises:
            FinlabError: there is none.
        """
        plain = "".join(code[:40].split()).upper()
        if plain not in self._by_code:
            raise FinlabError(
                f"there is no page to follow with the code {plain!r:.20}; ask for the code anew: "
                "Share, then Let others follow"
            )
        return self._by_code[plain]

    def end(self, lecture: Lecture) -> None:
        """Lets nobody follow any more."""
        self._by_code.pop(lecture.code, None)
        lecture.is_open = False
        lecture.tell()


class FollowFacts(NamedTuple):
    """What a page says of whom it follows, and of who follows it."""

    follows: str
    """Code of the page that it follows; empty for none."""
    is_followed_open: bool
    """Whether that page is there."""
    lecture_code: str
    """Its own code; empty where it may not be followed."""
    follower_count: int
    """Pages that follow it."""


NOBODY = FollowFacts("", False, "", 0)
"""Where a page follows none, and none follows it."""


class Following:
    """Whom one page follows, and who follows it."""

    def __init__(self, context: Context, lectures: Lectures) -> None:
        self._session = context.session
        self._bell = context.bell
        self._lectures = lectures
        self._followed: Lecture | None = None
        self._follower: Follower | None = None
        self._shown: Scene | None = None
        self.lecture = lectures.of(context.session)
        """The own session's, where it may be followed."""
        self.facts = NOBODY
        """What the page says of it."""
        if self.lecture is not None:  # the page was loaded anew
            self._open(self.lecture)

    @property
    def is_following(self) -> bool:
        """Whether the page shows what another one shows."""
        return self._followed is not None

    def _note(self) -> None:
        """Brings what the page says of it up to date."""
        followed = self._followed
        lecture = self.lecture
        self.facts = FollowFacts(
            follows="" if followed is None else followed.code,
            is_followed_open=followed is not None and followed.is_open,
            lecture_code="" if lecture is None else lecture.code,
            follower_count=0 if lecture is None else len(lecture.followers),
        )

    def let_follow(self) -> str:
        """Lets others follow this page; returns the code."""
        self.lecture = self._lectures.begin(self._session)
        self._open(self.lecture)
        return self.lecture.code

    def _open(self, lecture: Lecture) -> None:
        lecture.is_open = True
        lecture.teacher = self
        lecture.tell()
        self._note()

    def stop_lecture(self) -> None:
        """Lets nobody follow this page any more."""
        if self.lecture is not None:
            self._lectures.end(self.lecture)
            self.lecture = None
            self._note()

    def follow(self, code: str) -> None:
        """Shows what the page of a code shows. FinlabError: there is none, or it is this one."""
        lecture = self._lectures.find(code)
        if lecture.session is self._session:
            raise FinlabError("this is the page with that code; open the link in another browser")
        if self._followed is lecture:
            return
        self._leave()
        self._follower = Follower(self._session)
        self._followed = lecture
        lecture.followers.append(self)
        lecture.count()
        self.attend()

    def make_mine(self) -> None:
        """What is shown becomes this page's own work."""
        if self._follower is not None:
            self._follower.take_over()
            self._follower = None
            self._leave()

    def _leave(self) -> None:
        """Follows no longer; the own work comes back unless it was taken over."""
        if self._follower is not None:
            self._follower.end()
            self._follower = None
        if self._followed is not None:
            self._followed.followers.remove(self)
            self._followed.count()
        self._followed = None
        self._shown = None
        self._note()

    def ring(self) -> None:
        """Let this page look."""
        self._bell.ring(self)

    def attend(self) -> bool:
        """Shows what the followed page shows; whether the page is to be written."""
        self._note()
        if self._followed is not None and self._follower is not None and self._followed.is_open:
            scene = Scene.of(self._followed.session)
            if scene != self._shown:
                self._shown = scene
                self._follower.show(scene)
        return True

    def close(self) -> None:
        """The page has gone; its code stays good for when it comes back."""
        self._leave()
        lecture = self.lecture
        if lecture is not None and lecture.teacher is self:
            lecture.is_open = False
            lecture.teacher = None
            lecture.tell()
