"""Banner of a page that follows another one, and the sign of a page that is followed; their other
half is `following.js`."""

import json

from webapp.handles import button
from webapp.markup.words import html
from webapp.page import Page
from webapp.viser_internals import run_file, run_script

READ_ONLY = "this page follows another one; press Make it mine to go on by yourself"
"""What a user is told who changes something there."""
LET_FOLLOW = (
    "Whoever opens this link sees what this page shows, as you change it, until they make it "
    "theirs."
)


def add_following(page: Page) -> None:
    """Let a page follow another one, and be followed."""
    following = page.following
    run_file(page.gui, "following.js")
    page.board.group()
    page.add_html(banner)
    page.add_html(lecture_sign)

    def let_follow(_key: str, _text: str) -> None:
        code = following.let_follow()
        card = json.dumps([f"Let others follow: {code}", LET_FOLLOW, code])
        run_script(page.gui, f"finlabCards.follow(...{card});")

    def follow(key: str, _text: str) -> None:
        page.lock(READ_ONLY)
        try:
            following.follow(key)
        finally:
            if not following.is_following:
                page.lock("")
                run_script(page.gui, "finlabFollowing.leave();")

    def make_mine(_key: str, _text: str) -> None:
        following.make_mine()
        page.lock("")
        run_script(page.gui, "finlabFollowing.leave();")

    page.presses.on("let-follow", let_follow)
    page.presses.on("end-lecture", lambda *_: following.stop_lecture())
    page.presses.on("follow", follow, looks=True)
    page.presses.on("mine", make_mine, looks=True)


def begin_following(page: Page) -> None:
    """Let the browser say whom it follows; called when it can be heard."""
    run_script(page.gui, "finlabFollowing.begin();")


def banner(follows: str, is_followed_open: bool) -> str:
    """What a page that follows another one says of that.

    Args:
        follows: code of that page; empty for none.
        is_followed_open: whether that page is there.
    """
    if not follows:
        return ""
    words = html("You follow <b>{}</b>. What you see is theirs.", follows)
    if not is_followed_open:
        words = html("<b>{}</b> has left. This is what their page showed last.", follows)
    template = "<div class='fl fl-follow' role='status'><span>{}</span>{}</div>"
    return html(template, words, button("Make it mine", "mine"))


def lecture_sign(lecture_code: str, follower_count: int) -> str:
    """What a page says that others may follow.

    Args:
        lecture_code: its code; empty where nobody may.
        follower_count: pages that do.
    """
    if not lecture_code:
        return ""
    count = "nobody" if follower_count == 0 else f"{follower_count}"
    words = html("Others follow by <b>{}</b>: {}", lecture_code, count)
    template = "<div class='fl fl-lecture' role='status'><span>{}</span>{}{}</div>"
    show = button("Link", "let-follow")
    return html(template, words, show, button("Stop", "end-lecture"))
