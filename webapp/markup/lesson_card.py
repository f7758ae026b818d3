"""The card of a lesson: what is to be seen, what to do, and whether it is done."""

from html import escape

from webapp.markup.first_sight import tell
from webapp.session.lessons import LESSONS, Lesson


def lesson_card(lesson: Lesson, solved: bool) -> str:
    """Title, text, exercise and the way on."""
    place = LESSONS.index(lesson) + 1
    last = place == len(LESSONS)
    state = "done" if solved else "open"
    mark = "✓" if solved else "○"
    praise = f"<p role='status'>{escape(lesson.praise)}</p>" if solved else ""
    primary, onward = "class=primary" if solved else "", "Finish" if last else "Next lesson"
    return (
        f"<div class='fl fl-tour fl-lesson {state}'><b>Lesson {place} of {len(LESSONS)} · "
        f"{escape(lesson.title)}</b><p>{escape(lesson.text)}</p>"
        f"<p class='exercise'><span class='mark'>{mark}</span>{escape(lesson.exercise)}</p>{praise}"
        f"<div class='row'><button {primary} onclick=\"{tell('lesson-next,')}\">{onward}</button>"
        f'<button onclick="{tell("lesson-close,")}">Close</button></div></div>'
    )
