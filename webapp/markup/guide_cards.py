"""The cards of the tour and of lessons: what is to be seen, what to do, and the way on."""

from markupsafe import Markup

from webapp.markup.html import html
from webapp.presses import press
from webapp.session.lessons import LESSONS, Lesson
from webapp.session.tour import STEPS


def tour_card(index: int) -> str:
    """Title and text of a stop."""
    step, last = STEPS[index], index + 1 == len(STEPS)
    ways = [_button("Back", "back")] if index else []
    ways.append(_button("Finish" if last else "Next", "tour", primary=True))
    ways += [] if last else [_button("End the tour", "end")]
    title = f"{index + 1} of {len(STEPS)} · {step.title}"
    return _card("fl-tour tour", title, html("<p>{}</p>", step.text), ways)


def lesson_card(lesson: Lesson, solved: bool) -> str:
    """Title, text and exercise, and praise once that is done."""
    place = LESSONS.index(lesson) + 1
    mark, praise = "○", ""
    if solved:
        mark, praise = "✓", html("<p role='status'>{}</p>", lesson.praise)
    text = html(
        "<p>{}</p><p class='exercise'><span class='mark'>{}</span>{}</p>{}",
        lesson.text,
        mark,
        lesson.exercise,
        praise,
    )
    onward = "Finish" if place == len(LESSONS) else "Next lesson"
    ways = [_button(onward, "lesson-next", primary=solved), _button("Close", "lesson-close")]
    kind = f"fl-tour fl-lesson {'done' if solved else 'open'}"
    return _card(kind, f"Lesson {place} of {len(LESSONS)} · {lesson.title}", text, ways)


def _card(kind: str, title: str, text: str, ways: list[str]) -> str:
    buttons = Markup().join(ways)
    return html("<div class='fl {}'><b>{}</b>{}<div class='row'>{}</div></div>", kind, title, text, buttons)


def _button(label: str, word: str, primary: bool = False) -> str:
    return html("<button {} {}>{}</button>", "class=primary" * primary, press(word, ""), label)
