// Words of the app's own markup that can be pressed: data-press says what one is, data-key of whom. The server
// (handles.py) hears of each once, and of what else scripts of ours tell it.
//
// Private part of viser that is used here: `__viserMutable.sendMessage` (ViewerContext.ts in src/viser/client/src of
// viser-project/viser) sends the value of a hidden text box, at once and without its debounce. A message from the page
// to Python that scripts may send would do, as `RunJavascriptMessage` is one the other way (WebsocketMessages.ts).
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
    start(uuid) {
      if (channel === null) setTimeout(() => openLinked(enteredWith()));
      channel = uuid; last = 0; unheard = []; clearTimeout(timer);
    },
    tell,
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

  // A file that is dropped anywhere on the page goes the way of one that is chosen by the Open button. On a row of the
  // list of fins it is for that fin. Several files, or a folder, are refused by the server.
  const page = document.documentElement;
  const isFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes('Files');
  const show = (over) => page.classList.toggle('fl-dropping', over);

  const carried = (kind, hear) => window.addEventListener(kind, (event) => isFiles(event) && hear(event), { capture: true });
  carried('dragover', (event) => {
    event.preventDefault();
    event.dataTransfer.dropEffect = 'copy';
    show(true);
  });
  carried('dragleave', (event) => { if (!event.relatedTarget) show(false); });
  carried('drop', (event) => {
    event.preventDefault();
    event.stopPropagation();
    show(false);
    const { files, items } = event.dataTransfer;
    if (files.length !== 1 || items[0].webkitGetAsEntry?.()?.isDirectory) return void tell('dropped', '', '');
    const row = event.target.closest?.('.fin-list [data-press=fin]');
    if (row) tell('fin', row.dataset.key, '');
    const box = document.querySelector('[data-fl~=file] ~ div input[type=file]');
    box.files = files;
    box.dispatchEvent(new Event('change', { bubbles: true }));
  });

  // The design in the address that the page was opened with.
  function openLinked(hash) {
    if (!hash.startsWith('#design=')) return;
    tell('design-link', '', hash.slice(1));
    history.replaceState(null, '', location.pathname + location.search); // a reload goes on with what was made of it
  }

  // viser rewrites the address before anything of ours runs; how the page was entered is remembered elsewhere.
  function enteredWith() {
    const [entry] = performance.getEntriesByType('navigation');
    return location.hash || new URL(entry?.name ?? location.href).hash;
  }

  window.addEventListener('hashchange', () => openLinked(location.hash));
})();
