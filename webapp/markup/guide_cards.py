"""The cards of the tour and of lessons: what is to be seen, what to do, and the way on."""

from html import escape

from webapp.editables import press
from webapp.session.lessons import LESSONS, Lesson
from webapp.session.tour import STEPS


def tour_card(index: int) -> str:
    """Title and text of a stop."""
    step, last = STEPS[index], index + 1 == len(STEPS)
    ways = [_button("Back", "back")] if index else []
    ways.append(_button("Finish" if last else "Next", "tour", primary=True))
    ways += [] if last else [_button("End the tour", "end")]
    title = f"{index + 1} of {len(STEPS)} · {step.title}"
    return _card("fl-tour tour", title, f"<p>{escape(step.text)}</p>", ways)


def lesson_card(lesson: Lesson, solved: bool) -> str:
    """Title, text and exercise, and praise once that is done."""
    place = LESSONS.index(lesson) + 1
    mark, praise = "○", ""
    if solved:
        mark, praise = "✓", f"<p role='status'>{escape(lesson.praise)}</p>"
    text = (
        f"<p>{escape(lesson.text)}</p>"
        f"<p class='exercise'><span class='mark'>{mark}</span>{escape(lesson.exercise)}</p>{praise}"
    )
    onward = "Finish" if place == len(LESSONS) else "Next lesson"
    ways = [_button(onward, "lesson-next", primary=solved), _button("Close", "lesson-close")]
    kind = f"fl-tour fl-lesson {'done' if solved else 'open'}"
    return _card(kind, f"Lesson {place} of {len(LESSONS)} · {lesson.title}", text, ways)


def _card(kind: str, title: str, text: str, ways: list[str]) -> str:
    buttons = "".join(ways)
    return f"<div class='fl {kind}'><b>{escape(title)}</b>{text}<div class='row'>{buttons}</div></div>"


def _button(label: str, word: str, primary: bool = False) -> str:
    return f"<button {'class=primary' * primary} {press(word, '')}>{label}</button>"
