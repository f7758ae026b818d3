// Words of the app's own markup that can be pressed: data-press says what one is, data-key of whom. The server
// (handles.py) hears of each once, and of what else scripts of ours tell it.
(() => {
  if (window.finlabPresses) return;
  const AGAIN_MS = 700, TRIES = 40; // a page that is just connecting may lose what it is told to send
  let channel = null, last = 0, unheard = [], timer = 0, tries = 0;

  function post() {
    clearTimeout(timer);
    if (!unheard.length || ++tries > TRIES) return;
    window.__viserMutable?.sendMessage?.(
      { type: 'GuiUpdateMessage', uuid: channel, updates: { value: JSON.stringify(unheard) } });
    timer = setTimeout(post, AGAIN_MS);
  }

  function tell(kind, key, text) {
    unheard.push([++last, kind, key, text]);
    tries = 0;
    post();
  }

  window.finlabPresses = {
    start(uuid) { channel = uuid; last = 0; unheard = []; clearTimeout(timer); },
    tell,
    ready: () => channel !== null,
    heard(number) { unheard = unheard.filter((word) => word[0] > number); },
  };

  const pressed = (target) => (target instanceof Element ? target.closest('[data-press]') : null);
  const listen = (kind, hear) => window.addEventListener(kind, (event) => {
    const found = pressed(event.target);
    if (found) hear(event, found.dataset);
  }, { capture: true });
  const press = (event, { press, key }) =>
    tell(press, key, event.shiftKey ? 'shift' : event.ctrlKey || event.metaKey ? 'ctrl' : '');
  // A word that is rendered again while the button is down is another element, and the browser makes no click of it.
  let down = null;
  window.addEventListener('mousedown', (event) => { down = { ...pressed(event.target)?.dataset }; }, { capture: true });
  listen('mouseup', (event, word) => {
    if (event.button === 0 && down?.press === word.press && down.key === word.key) press(event, word);
    down = null;
  });
  listen('click', (event, word) => { if (event.detail === 0) press(event, word); }); // by a key, or by a script
  listen('mousedown', (event) => { if (event.shiftKey) event.preventDefault(); }); // else text is marked
  listen('keydown', (event, { press, key }) => {
    if (event.key === 'Enter' && event.target.matches('[data-press][tabindex]')) tell(press, key, '');
  });
})();
