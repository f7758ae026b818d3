"""Pages that nobody looks at: they draw seldom, as one in the background would."""

SCRIPT = """
const soon = window.requestAnimationFrame.bind(window), waiting = new Map();
let last = 0, due = false;
function draw(time) {
  const all = [...waiting.values()];
  due = false;
  waiting.clear();
  for (const act of all) act(time);
}
window.requestAnimationFrame = act => {
  waiting.set(++last, act);
  if (!due) window.setTimeout(() => soon(draw), EVERY_MS);
  due = true;
  return last;
};
window.cancelAnimationFrame = number => waiting.delete(number);
"""


def slow_drawing(every_ms: int) -> str:
    """A script to run before the page's own: a frame at most each so many milliseconds."""
    return SCRIPT.replace("EVERY_MS", str(every_ms))
