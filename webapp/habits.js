// What the page of viser does otherwise: with Ctrl, or on a slider, the camera stays where it is, keys have their usual
// second names, and buttons have hints.
//
// No private part of viser is used here, but the classes of Mantine's elements, and how viser nests them; each part below
// says what it makes up for. Upstream (src/viser/client/src/components of viser-project/viser): NumberInput.tsx,
// TextInput.tsx (send with Enter), Dropdown.tsx (select what is typed over), Button.tsx (hints), common.tsx (names for
// readers of the screen, a class of one's own for a folder or for markup), and App.tsx (keys of the camera).
(() => {
  if (window.finlabFrame) return;
  const page = document.documentElement;
  const MOVES = /^(Key[WASDQE]|Arrow)/;
  const typing = (target) => target.closest?.('input, textarea, [contenteditable=true]');

  window.finlabFrame = true;

  window.addEventListener('keydown', (event) => {
    const held = event.ctrlKey || event.metaKey;
    const menu = event.key === 'Escape' && document.querySelector('[popover]:popover-open');
    if (menu) { // else it is a key of the page, which would close the tour as well
      menu.hidePopover();
      event.stopImmediatePropagation();
      return;
    }
    if (typing(event.target)) return;
    if (held && !event.shiftKey && event.key.toLowerCase() === 'y') {
      event.preventDefault();
      event.stopImmediatePropagation();
      page.dispatchEvent(new KeyboardEvent('keydown', { key: 'z', code: 'KeyZ', ctrlKey: true, shiftKey: true, bubbles: true }));
    }
  }, { capture: true });

  // What is typed counts when it is whole: with Enter, or when the box is left. Viser would send every key, and write
  // over half a text; so until then what the framework writes is only remembered. The text of a number box goes to the
  // server as it was typed (`number_boxes.py`): Mantine would drop what is no digit, and hold it to the slider's ends.
  const NUMBER = '.mantine-NumberInput-input', BOXES = `${NUMBER}, .mantine-TextInput-input, .mantine-Textarea-input`;
  const LONGEST = 80; // signs of a number that are sent
  let box = null, before = '', own = null;
  const plain = () => Object.getOwnPropertyDescriptor(Object.getPrototypeOf(box), 'value');

  function begin(target) {
    [box, before, own] = [target, target.value, Object.getOwnPropertyDescriptor(target, 'value')];
    const { get } = plain();
    Object.defineProperty(box, 'value', { configurable: true, get, set: (text) => { before = text; } });
  }
  // A number box is told by its label's input, and of several by its place.
  function rowOf(box) {
    let row = box.parentElement;
    while (!row.querySelector('label[for]')) row = row.parentElement;
    return row;
  }
  function owner(box) {
    const row = rowOf(box);
    return `${row.querySelector('label[for]').htmlFor} ${[...row.querySelectorAll(NUMBER)].indexOf(box)}`;
  }
  function end(text, steps = 0) {
    const ended = box, { set } = plain();
    box = null;
    delete ended.value;
    if (own) Object.defineProperty(ended, 'value', own);
    ended.value = before;
    if (text === before) return;
    if (ended.matches(NUMBER)) {
      window.finlabPresses?.tell('number', `${owner(ended)} ${steps}`, text.slice(0, LONGEST));
      return;
    }
    window.finlabPresses?.tell('typed', '', '');
    set.call(ended, text);
    ended.dispatchEvent(new InputEvent('input', { bubbles: true }));
  }
  const commit = (steps) => end(box.value, steps);

  const listen = (kind, hear) => window.addEventListener(kind, hear, { capture: true });
  listen('beforeinput', ({ target, inputType }) => {
    if (target.tagName === 'INPUT' && inputType === 'insertLineBreak') return; // Enter, which changes nothing
    if (target === box || !target.matches?.(BOXES) || !target.closest('.mantine-Flex-root')) return;
    if (box) commit();
    begin(target);
  });
  listen('input', (event) => { if (event.isTrusted && event.target === box) event.stopImmediatePropagation(); });
  listen('change', (event) => { if (event.isTrusted && event.target === box) { event.stopImmediatePropagation(); commit(); } });
  listen('focusout', ({ target }) => { if (target === box) commit(); });
  listen('mousedown', ({ target }) => { if (box && target !== box) commit(); });
  // A step up or down goes on from what is typed; from what is asked it is Mantine's.
  function step(event, steps) {
    const isTyped = box.value !== before && box.matches(NUMBER);
    commit(steps);
    if (isTyped) { event.preventDefault(); event.stopImmediatePropagation(); }
  }
  listen('keydown', (event) => {
    const { key, target, isTrusted } = event;
    if (target !== box || !isTrusted) return;
    if (key === 'Escape') end(before);
    else if (box.tagName !== 'INPUT') return;
    else if (key === 'Enter') commit();
    else if (key === 'ArrowUp' || key === 'ArrowDown') step(event, key === 'ArrowUp' ? 1 : -1);
  });

  // Each drag of a slider is a step of undo, and all keys that follow each other within a second.
  const QUICK_MS = 1000;
  let lastKey = 0;
  const begins = () => window.finlabPresses?.tell('typed', '', '');
  listen('pointerdown', ({ target }) => { if (target.closest?.('.mantine-Slider-root')) begins(); });
  listen('keydown', ({ key, target, timeStamp }) => {
    if (!/^(Arrow|Page|Home|End)/.test(key) || !target.matches?.(`[role=slider], ${NUMBER}`)) return;
    if (timeStamp - lastKey > QUICK_MS) begins();
    lastKey = timeStamp;
  });

  // A finger that goes along a slider drags it, and one that goes across scrolls the panel: Mantine would take hold of
  // the slider with the first touch. So that touch is told once it is known to drag; what only taps is told by the mouse
  // events that a browser makes of it.
  const SLOP = 6; // pixels
  let finger = null;
  const hearTouch = (kind, hear) => window.addEventListener(kind, hear, { capture: true, passive: true });
  hearTouch('touchstart', (event) => {
    if (!event.isTrusted) return;
    const { target, touches } = event;
    finger = touches.length === 1 && target.closest?.('.mantine-Slider-root') ? { target, ...at(touches[0]) } : null;
    if (finger) event.stopImmediatePropagation();
  });
  hearTouch('touchmove', ({ isTrusted, touches, changedTouches }) => {
    if (!isTrusted || !finger) return;
    const { x, y } = at(touches[0]), along = Math.abs(x - finger.x), across = Math.abs(y - finger.y);
    if (Math.max(along, across) < SLOP) return;
    const { target } = finger;
    finger = null;
    if (across > along) return;
    const init = { touches: [...touches], changedTouches: [...changedTouches], bubbles: true, cancelable: true };
    target.dispatchEvent(new TouchEvent('touchstart', init));
  });
  function at({ clientX, clientY }) { return { x: clientX, y: clientY }; }

  // Page keys go ten steps, Home and End to the ends of a slider: the server knows both (`number_boxes.py`). While one
  // types, Home and End belong to the text.
  listen('keydown', (event) => {
    const { key, target } = event;
    if (!/^(PageUp|PageDown|Home|End)$/.test(key) || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    const isThumb = target.matches?.('[role=slider]');
    if (!isThumb && !target.matches?.(NUMBER)) return;
    const row = rowOf(target);
    const number = isThumb ? row.querySelector(NUMBER) : target;
    if (!number || number.disabled) return;
    const toEnd = key === 'Home' || key === 'End';
    if (toEnd && (box || !row.querySelector('[role=slider]'))) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (box) commit();
    window.finlabPresses?.tell('jump', owner(number), key);
  });

  // A double click takes the whole number; the browser would leave the sign before it.
  listen('dblclick', ({ target }) => { if (target.matches?.(NUMBER)) target.select(); });

  // What is typed into a list takes the place of what is chosen there, and Enter takes the first that is left.
  const isList = (target) => target.matches?.('.mantine-Select-input');
  listen('click', ({ target }) => { if (isList(target)) target.select(); });
  listen('focusin', ({ target }) => { if (isList(target)) target.select(); });
  listen('keydown', ({ key, target }) => {
    const left = key === 'Enter' && isList(target) && document.getElementById(target.getAttribute('aria-controls'));
    if (left && !left.querySelector('[data-combobox-selected]')) left.querySelector('[role=option]')?.click();
  });

  // The theme follows the system, until the user chooses one.
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', ({ matches }) =>
    window.finlabPresses?.tell('scheme', matches ? 'dark' : 'light', ''));

  // Commands listen on the root of the document, the camera on the document, which comes after.
  page.addEventListener('keydown', (event) => {
    const others = event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.('[role=slider]');
    if (others && MOVES.test(event.code)) event.stopPropagation();
  });

  window.addEventListener('beforeunload', (event) => { if (window.finlabDrops) event.preventDefault(); });

  // The hint of a button, after its label where that is cut.
  window.addEventListener('pointerover', (event) => {
    const button = event.target.closest?.('.mantine-Button-root');
    const label = button?.querySelector('.mantine-Button-label');
    if (!label) return;
    const isCut = label.scrollWidth > label.clientWidth;
    button.title = [isCut && label.textContent, window.finlabHints?.get(button.id)].filter(Boolean).join('\n');
  });

  // Names for boxes and sliders that have none of their own: viser ties a row's label to one element of the row at most,
  // so a reader of the screen would hear only "edit text, 0.5". Each is called as its row, of several with its place.
  let asked = 0;
  document.getElementById('root').role = 'main';  // all that viser draws; it has no landmark

  // The inspector begins at its top where it turns from the robot to an actuator, or back.
  let inspected = '';
  function inspect() {
    const inspector = document.querySelector('[data-fl~=region][data-fl~=right]');
    const shown = ['Actuator', 'Body'].find((part) => inspector?.querySelector(`[data-fl~=${part}]`)?.checkVisibility()) ?? '';
    if (shown === inspected) return;
    inspected = shown;
    inspector?.scrollTo(0, 0);
  }

  // At each stop and lesson all panels begin at their top, where its card says that things are, and a phone shows what it
  // speaks of; its praise comes into sight.
  let stop = '', isPraised = false;
  function guide() {
    const card = document.querySelector('.fl-tour'), praise = card?.querySelector('[role=status]');
    const title = card?.querySelector('b').textContent ?? '';
    if (card && title !== stop) {
      page.dataset.flSheet = innerWidth > 600 ? '' : card.dataset.sheet;
      for (const region of document.querySelectorAll('[data-fl~=region]')) region.scrollTo(0, 0);
    } else if (praise && !isPraised) praise.scrollIntoView({ block: 'nearest' });
    [stop, isPraised] = [title, !!praise];
  }

  // On a phone a region may hold nothing but text: the arrow keys scroll it once Tab has come to it.
  function scroll() {
    for (const region of document.querySelectorAll('[data-fl~=region]')) {
      const isLong = region.scrollHeight > region.clientHeight + 1;
      const isReached = [...region.querySelectorAll('button, input, a, [tabindex="0"]')].some((one) => one.checkVisibility());
      region.toggleAttribute('tabindex', isLong && !isReached);
      if (region.hasAttribute('tabindex')) region.tabIndex = 0;
    }
  }

  function name() {
    asked = 0;
    inspect();
    guide();
    const list = document.querySelector('.mantine-Spotlight-content');
    list?.setAttribute('aria-label', 'Commands');
    list?.querySelector('[data-scrollarea-viewport]')?.setAttribute('tabindex', '0');
    for (const close of document.querySelectorAll('.mantine-Notification-closeButton:not([aria-label])'))
      close.setAttribute('aria-label', 'Close the note');
    // What explains a box stands outside of all regions: it is one of its own while it is shown.
    const hint = document.querySelector('.mantine-Tooltip-tooltip')?.closest('[data-portal]');
    if (hint && !hint.hasAttribute('role')) Object.assign(hint, { role: 'region', ariaLabel: 'Hint' });
    if (innerWidth <= 600) scroll();
    for (const label of document.querySelectorAll('label[for]')) {
      const row = label.closest('.mantine-Flex-root');
      const found = row ? [...row.querySelectorAll('input:not([type=hidden]):not([type=file]), textarea, [role=slider]')] : [];
      const alike = (box) => found.filter((other) => other.getAttribute('role') === box.getAttribute('role'));
      for (const box of found) {
        const kin = alike(box), place = kin.length > 1 ? `, ${kin.indexOf(box) + 1} of ${kin.length}` : '';
        if (box.id === label.htmlFor && !place) continue;
        const called = label.textContent + place;
        if (box.getAttribute('aria-label') !== called) box.setAttribute('aria-label', called);
      }
      // The arrow keys do the same in the number box beside a slider: Tab goes from box to box.
      for (const box of found) {
        const isTwice = box.getAttribute('role') === 'slider' && row.querySelector(NUMBER);
        if (isTwice && box.tabIndex !== -1) box.tabIndex = -1;
      }
    }
  }

  // Elements get the words of the markers and markup in them: a style that looked for these itself (`:has`) would cost tens
  // of milliseconds at every change of the page. A folder has those of its marker (`region top`, `section at-3 Check`), what
  // holds markup those of that, `plot` and `score` among them, and `bare` where it shows nothing, and inputs stand in a `row`.
  const FOLDER = '.mantine-Paper-root', MARKUP = ':not([class^=fl]) > [class^=fl]', HEADING = `${FOLDER} > ${FOLDER}:first-child`;
  const ROWS = '.mantine-Flex-root, .mantine-Button-root', CANVAS = '[data-dock-root] > div > canvas', DEPTH = 5;

  function tag(element) {
    const { parentElement: holder } = element;
    if (!holder || holder.nodeType !== Node.ELEMENT_NODE) return;
    if (element.matches(HEADING)) holder.dataset.titled = '';
    else if (element.matches(CANVAS)) holder.dataset.fl = 'canvas';
    else if (element.matches(ROWS)) {
      if (!holder.matches(ROWS)) holder.dataset.fl = 'row';
      else holder.toggleAttribute('data-many', holder.childElementCount > 5);
    } else if (element.matches('i.fl-region, i.fl-section')) {
      let folder = element;
      for (let k = 0; k < DEPTH; k++) folder = folder?.parentElement;
      if (folder?.matches(FOLDER)) folder.dataset.fl = element.className.replaceAll('fl-', '');
      holder.dataset.fl = 'bare';
    } else if (element.matches(MARKUP)) {
      const parts = [...holder.children], words = parts.flatMap((part) => [...part.classList]).map((word) => word.replace('fl-', ''));
      words.push(...['plot', 'score'].filter((word) => holder.querySelector(`.${word}`)));
      if (parts.every((part) => part.matches('i, style'))) words.push('bare');
      if (words.includes('modes')) holder.parentElement?.toggleAttribute('data-asking', words.includes('asking'));
      holder.dataset.fl = words.join(' ');
      if (element.matches('.fl-chrome'))
        for (let up = holder; up; up = up.parentElement) if (up.matches(`[data-dock-region], #root ${FOLDER}`)) up.dataset.fl = 'panel';
    }
  }

  const TAGGED = [MARKUP, HEADING, ROWS, CANVAS].join();
  function look(changes) {
    asked ||= setTimeout(name, 100);
    for (const { addedNodes } of changes)
      for (const node of addedNodes)
        if (node.nodeType === Node.ELEMENT_NODE) [node, ...node.querySelectorAll(TAGGED)].forEach(tag);
    page.toggleAttribute('data-ready', !!document.querySelector('.fl-chrome'));
    page.toggleAttribute('data-long', !!document.querySelector('.fl-legend .wide, .fl-status .pill.long'));
  }
  new MutationObserver(look).observe(document.body, { childList: true, subtree: true, characterData: true });
  look([{ addedNodes: [document.body] }]);

  // Where the mouse or the focus is: what explains a row stands beside its region.
  for (const kind of ['pointerover', 'focusin'])
    listen(kind, ({ target }) => { page.dataset.over = target.closest?.('[data-fl~=region]')?.dataset.fl ?? ''; });
})();
