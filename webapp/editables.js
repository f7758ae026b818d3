// Words in the app's own markup that can be edited where they stand, and pressed. A cell says what it is by
// data-edit or data-press, and of which item by data-key; both go to the server (editables.py) on one channel. The box in
// which one types lies over the cell and is not viser's: it stays when the panel is rendered again.
(() => {
  if (window.finlabEditables) return;
  const AGAIN_MS = 700, TRIES = 40; // a page that is just connecting may lose what it is told to send
  let channel = null, last = 0, unheard = [], editor = null, timer = 0, tries = 0;

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
    return last;
  }

  const cellOf = (kind, key) => [...document.querySelectorAll(`[data-edit="${kind}"]`)]
    .find((cell) => cell.dataset.key === key && cell.offsetParent !== null);
  const cells = () => [...document.querySelectorAll('[data-edit]')].filter((cell) => cell.offsetParent !== null);

  function place() {
    if (!editor) return;
    const cell = cellOf(editor.kind, editor.key);
    if (!cell) return;
    const at = cell.getBoundingClientRect();
    const { style } = editor.box;
    style.left = `${at.left - 5}px`;
    style.top = `${at.top - 3}px`;
    style.width = `${Math.max(at.width + 10, editor.rows > 1 ? 220 : 58)}px`;
    style.height = `${Math.max(at.height + 6, editor.rows > 1 ? 18 * editor.rows + 10 : 24)}px`;
    editor.note.style.left = style.left;
    editor.note.style.top = `${at.top - 3 + editor.box.offsetHeight}px`;
  }

  function open(cell) {
    close();
    const rows = Number(cell.dataset.rows ?? 1);
    const box = document.createElement(rows > 1 ? 'textarea' : 'input');
    const note = document.createElement('div');
    box.className = 'fl-editor';
    note.className = 'fl-editor-note';
    note.setAttribute('role', 'alert');
    box.value = cell.dataset.value ?? cell.innerText;
    box.setAttribute('aria-label', cell.getAttribute('aria-label') ?? cell.dataset.edit);
    box.spellcheck = false;
    const font = getComputedStyle(cell);
    box.style.fontSize = font.fontSize;
    box.style.fontWeight = font.fontWeight;
    box.style.textAlign = font.textAlign;
    editor = { box, note, rows, kind: cell.dataset.edit, key: cell.dataset.key, before: box.value, sent: 0, next: 0 };
    document.body.append(box, note);
    place();
    box.focus();
    box.select();
  }

  function close() {
    if (!editor) return;
    const { box, note } = editor;
    editor = null;
    box.remove();
    note.remove();
  }

  function commit(next = 0) {
    if (!editor || editor.sent) return;
    editor.next = next;
    editor.at = cells().indexOf(cellOf(editor.kind, editor.key)); // a new name will be another key
    if (editor.box.value === editor.before) return done();
    editor.sent = tell(editor.kind, editor.key, editor.box.value);
  }

  function done() {
    const { at, next, box } = editor;
    const all = cells(), cell = all[at];
    const focused = document.activeElement === box;
    close();
    if (next && cell) open(all[(at + next + all.length) % all.length]);
    else if (focused) cell?.focus({ preventScroll: true });
  }

  window.finlabEditables = {
    start(uuid) { channel = uuid; last = 0; unheard = []; clearTimeout(timer); close(); },
    tell,
    ready: () => channel !== null,
    answer(answers) {
      for (const [number, refusal] of answers) {
        if (!editor || editor.sent !== number) continue;
        editor.sent = 0;
        if (refusal === null) { done(); continue; }
        editor.box.setAttribute('aria-invalid', 'true');
        editor.note.textContent = refusal;
        place();
      }
      const heard = Math.max(...answers.map((answer) => answer[0]));
      unheard = unheard.filter((word) => word[0] > heard);
    },
  };

  const listen = (kind, hear) => window.addEventListener(kind, (event) => hear(event, event.target), { capture: true });
  const mods = (event) => (event.shiftKey ? 'shift' : event.ctrlKey || event.metaKey ? 'ctrl' : '');

  listen('click', (event, target) => {
    if (!(target instanceof Element) || target === editor?.box) return;
    const press = target.closest('[data-press]'), cell = target.closest('[data-edit]');
    if (cell && (cell.dataset.open === 'click' || event.detail === 2)) return open(cell);
    if (press && (event.detail < 2 || !cell)) tell(press.dataset.press, press.dataset.key, mods(event));
  });
  listen('mousedown', (event, target) => { // else the browser marks the text between two clicks
    if (target instanceof Element && target.closest('[data-press]') && (event.shiftKey || event.detail > 1))
      event.preventDefault();
  });
  listen('keydown', (event, target) => {
    if (editor && target === editor.box) {
      event.stopImmediatePropagation();
      editor.box.removeAttribute('aria-invalid');
      editor.note.textContent = '';
      const ends = event.key === 'Enter' && (editor.rows === 1 || event.ctrlKey || event.metaKey);
      if (ends || event.key === 'Tab') { event.preventDefault(); commit(ends ? 0 : event.shiftKey ? -1 : 1); }
      else if (event.key === 'Escape') {
        const cell = cellOf(editor.kind, editor.key);
        close();
        cell?.focus({ preventScroll: true });
      }
    } else if (target instanceof Element && target.matches('[data-edit]') && ['Enter', 'F2'].includes(event.key)) {
      event.preventDefault();
      event.stopImmediatePropagation();
      open(target);
    } else if (target instanceof Element && target.matches('[data-press][tabindex]') && event.key === 'Enter') {
      tell(target.dataset.press, target.dataset.key, '');
    }
  });
  listen('focusout', (event, target) => {
    if (editor && target === editor.box && document.hasFocus()) commit();
  });
  listen('scroll', place);
  window.addEventListener('resize', place);
})();
