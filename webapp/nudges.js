// Arrow keys move the selected actuators (`panels/nudging.py`): ahead, astern, left and right, with Shift up and down.
// Keys that repeat are gathered, so that the page sends at most one message in PAUSE_MS.
(() => {
  if (window.finlabNudges) return;
  const PAUSE_MS = 50;
  const WAYS = { ArrowUp: [1, 0, 0], ArrowDown: [-1, 0, 0], ArrowLeft: [0, 1, 0], ArrowRight: [0, -1, 0] };
  const RAISED = { ArrowUp: [0, 0, 1], ArrowDown: [0, 0, -1] };
  const OTHERS = 'input, textarea, select, [contenteditable=true], [role=slider], [role=listbox], [role=dialog], [popover]';
  let listens = false, sum = [0, 0, 0], timer = 0, last = -Infinity, held = false;

  function post() {
    timer = 0;
    last = performance.now();
    window.finlabPresses?.tell('nudge', sum.join(' '), held ? 'held' : '');
    sum = [0, 0, 0];
  }

  // Before the camera, which listens on the document.
  window.addEventListener('keydown', (event) => {
    if (!listens || event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.(OTHERS)) return;
    const way = (event.shiftKey ? RAISED : WAYS)[event.key];
    if (!way) return;
    event.preventDefault();
    event.stopPropagation();
    if (!timer) held = event.repeat;
    sum = sum.map((steps, axis) => steps + way[axis]);
    timer ||= setTimeout(post, Math.max(0, last + PAUSE_MS - performance.now()));
  }, { capture: true });

  window.finlabNudges = { listen: (moves) => { listens = moves; } };
})();
