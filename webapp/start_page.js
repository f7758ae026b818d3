// The start page: shown at once to whoever comes without a link and has no work here; else when the server says that the
// session is a new one. What is chosen before the app has connected is told as soon as it has.
(() => {
  const start = document.getElementById('fl-start');
  const shown = () => !start.hidden;
  let isReady = false, chosen = null, isDecided = false;

  function show(isDark, hasWork = false) {
    start.querySelector('.back').hidden = !hasWork;
    start.classList.toggle('dark', isDark);
    start.hidden = false;
    hold();
  }
  // What lies behind is neither read nor reached by a key.
  function hold() {
    const root = document.getElementById('root');
    if (root) root.inert = shown();
  }
  function hide() {
    start.hidden = true;
    start.querySelector('[aria-busy]')?.removeAttribute('aria-busy');
    chosen = null;
    hold();
  }

  function choose(key, button, files) {
    if (chosen) return;
    chosen = { key, files };
    button?.setAttribute('aria-busy', 'true');
    if (isReady) tell();
  }
  function tell() {
    const { key, files } = chosen;
    window.finlabPresses.tell('start', key, '');
    const box = files?.length && document.querySelector('[data-fl~=file] ~ div input[type=file]');
    if (!box) return;
    box.files = files;
    box.dispatchEvent(new Event('change', { bubbles: true }));
  }

  start.addEventListener('click', ({ target }) => {
    const button = target.closest('[data-start]');
    if (button) choose(button.dataset.start, button);
  });
  const input = start.querySelector('input[type=file]');
  input.addEventListener('change', () => { if (input.files.length) choose('file', input.parentElement, input.files); });
  // Keys of the app wait behind it; those of its buttons are the browser's own.
  for (const kind of ['keydown', 'keyup'])
    window.addEventListener(kind, (event) => {
      if (!shown()) return;
      event.stopImmediatePropagation();
      if (event.key === 'Escape' && kind === 'keydown') choose('back');
    }, { capture: true });

  const isDark = matchMedia('(prefers-color-scheme: dark)');
  const isLinked = location.search !== '' || location.hash !== '';
  let isKnown = true;
  try {
    isKnown = Object.keys(localStorage).some((key) => key.endsWith(':finlab-sessions'));
  } catch { /* a browser that forbids storage */ }
  if (!isLinked && !isKnown) show(isDark.matches);
  addEventListener('DOMContentLoaded', hold);

  window.finlabStart = {
    ready(isNew) {
      isReady = true;
      const robot = new URLSearchParams(location.search).get('robot');
      if (!isDecided && robot) window.finlabPresses.tell('robot-link', robot, '');
      if (chosen) tell();
      else if (!isDecided && !isLinked && isNew) show(isDark.matches);
      else if (!isNew) hide();
      isDecided = true;
    },
    open() { show(document.documentElement.dataset.mantineColorScheme === 'dark', true); start.querySelector('button').focus(); },
    close: hide,
  };
})();
