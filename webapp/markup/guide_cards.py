"""The card of a stop of the tour, or of a lesson: what is to be seen, what to do, and the way on."""

from webapp.markup.html import html
from webapp.presses import press
from webapp.session.lessons import LESSONS, TOUR, Stop


def guide_card(stop: Stop | None, solved: bool) -> str:
    """Title and text, and an exercise with praise once that is done; nothing outside of tour and lessons."""
    if stop is None:
        return ""
    course = TOUR if stop in TOUR else LESSONS
    place, last = course.index(stop) + 1, len(course)
    kind, title, parts = "tour", f"{place} of {last} · {stop.title}", [html("<p>{}</p>", stop.text)]
    if stop.exercise:
        kind, title = f"fl-lesson {'done' if solved else 'open'}", f"Lesson {title}"
        exercise = "<p class='exercise'><span class='mark'>{}</span>{}</p>"
        parts.append(html(exercise, "✓" if solved else "○", stop.exercise))
        if solved:
            parts.append(html("<p role='status'>{}</p>", stop.praise))
    ways = [_button("Back", "back")] if place > 1 else []
    ways.append(_button("Finish" if place == last else "Next", "on", primary=solved or not stop.exercise))
    ways += [] if place == last else [_button("Close", "end")]
    text = "<div class='fl fl-tour {}'><b>{}</b>{}<div class='row'>{}</div></div>"
    return html(text, kind, title, parts, ways)


def _button(label: str, word: str, primary: bool = False) -> str:
    return html("<button class='{}' {}>{}</button>", "primary" if primary else "", press(word, ""), label)
