// What the page of viser does otherwise: with Ctrl the camera stays where it is, keys have their usual second names,
// buttons have hints, and the first card comes and goes.
(() => {
  if (window.finlabFrame) return;
  const page = document.documentElement;
  const MOVES = /^(Key[WASDQE]|Arrow)/;
  const MET = 'finlab-met';
  const typing = (target) => target.closest?.('input, textarea, [contenteditable=true]');

  function kept(name) { try { return localStorage.getItem(name); } catch { return null; } }
  function keep(name, value) { try { localStorage.setItem(name, value); } catch { /* a browser that forbids it */ } }

  window.finlabFrame = {
    met() { page.classList.remove('fl-first'); keep(MET, '1'); },
  };
  if (!kept(MET)) page.classList.add('fl-first');

  window.addEventListener('keydown', (event) => {
    const held = event.ctrlKey || event.metaKey;
    if (typing(event.target)) return;
    if (held && !event.shiftKey && event.key.toLowerCase() === 'y') {
      event.preventDefault();
      event.stopImmediatePropagation();
      page.dispatchEvent(new KeyboardEvent('keydown', { key: 'z', code: 'KeyZ', ctrlKey: true, shiftKey: true, bubbles: true }));
    }
  }, { capture: true });

  // What is typed counts when it is whole: with Enter, or when the box is left. Viser would send every key, and write
  // over half a text; so from the first key until then the box's own `value`, by which the framework writes, does nothing.
  const BOXES = '.mantine-NumberInput-input, .mantine-TextInput-input, .mantine-Textarea-input';
  const held = new Map();
  const listen = (kind, hear) => window.addEventListener(kind, (event) => hear(event, event.target), { capture: true });

  function finish(box) {
    if (!held.has(box)) return;
    Object.defineProperty(box, 'value', held.get(box));
    held.delete(box);
    box.dispatchEvent(Object.assign(new Event('input', { bubbles: true }), { finlab: true }));
  }
  listen('input', (event, box) => {
    if (event.finlab || !box.matches?.(BOXES) || !box.closest('.mantine-Flex-root')) return;
    event.stopImmediatePropagation();
    const plain = Object.getOwnPropertyDescriptor(Object.getPrototypeOf(box), 'value');
    if (held.has(box)) return;
    held.set(box, Object.getOwnPropertyDescriptor(box, 'value') ?? { configurable: true, ...plain });
    Object.defineProperty(box, 'value', { configurable: true, get: () => plain.get.call(box), set: () => {} });
  });
  listen('keydown', (event, box) => {
    if (event.key === 'Enter' && box instanceof HTMLInputElement) finish(box);
  });
  listen('focusout', (_event, box) => finish(box));

  // Commands listen on the root of the document, the camera on the document, which comes after.
  page.addEventListener('keydown', (event) => {
    if ((event.ctrlKey || event.metaKey || event.altKey) && MOVES.test(event.code)) event.stopPropagation();
  });

  // The hint of a button, after its label where that is cut.
  window.addEventListener('pointerover', (event) => {
    const button = event.target.closest?.('.mantine-Button-root');
    const label = button?.querySelector('.mantine-Button-label');
    if (!label) return;
    const isCut = label.scrollWidth > label.clientWidth;
    button.title = [isCut && label.textContent, window.finlabHints?.get(button.id)].filter(Boolean).join('\n');
  });

})();
