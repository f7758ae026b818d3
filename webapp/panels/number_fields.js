// A number field is the user's own from the first key to Enter, Tab, Escape or a click elsewhere. viser sends every
// key to the server and writes every answer back: `-0` came back as 0 before the rest of -0.5 was typed. Here
// nothing half-typed leaves the field, and nothing is written into it until the user is done with it.
(() => {
  if (window.finlabNumberFields) return;
  window.finlabNumberFields = true;
  const PAUSE_MS = 1000; // a number that stands this long is meant
  const APART_MS = 80; // the page sends one change in 50 ms, a quicker one would overwrite the last
  const NUMBER = /^-?(\d+(\.\d+)?|\.\d+)$/;
  const text = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value');
  const held = new Map(); // fields in the user's hands
  let sending = false, sent = -APART_MS;

  const isNumberField = (element) =>
    element instanceof HTMLInputElement && element.classList.contains('mantine-NumberInput-input');

  function hold(field) {
    if (held.has(field)) return;
    // React watches its inputs by a property of their own; while it cannot write, it keeps what it wants to write
    // in the attribute `value`.
    held.set(field, { watched: Object.getOwnPropertyDescriptor(field, 'value') ?? text, told: null, timer: 0 });
    Object.defineProperty(field, 'value', { configurable: true, get: () => text.get.call(field), set: () => {} });
  }

  function tell(field) {
    const { watched, told } = held.get(field), typed = text.get.call(field).replace(/\.$/, '');
    if (!NUMBER.test(typed) || typed === told) return;
    const ends = [field.selectionStart, field.selectionEnd];
    watched.set.call(field, field.defaultValue); // what React believes to stand there
    text.set.call(field, typed);
    if (document.activeElement === field) field.setSelectionRange(...ends);
    held.get(field).told = typed;
    sending = true;
    field.dispatchEvent(new Event('input', { bubbles: true }));
    sending = false;
    sent = performance.now();
  }

  function release(field) {
    const { watched, timer } = held.get(field);
    clearTimeout(timer);
    held.delete(field);
    Object.defineProperty(field, 'value', watched);
    if (text.get.call(field) !== field.defaultValue) watched.set.call(field, field.defaultValue);
  }

  function finish(field) {
    const hand = held.get(field), wait = sent + APART_MS - performance.now();
    clearTimeout(hand.timer);
    if (wait > 0) hand.timer = setTimeout(finish, wait, field);
    else {
      tell(field);
      queueMicrotask(() => held.has(field) && release(field)); // React has taken the number by then
    }
  }

  const listen = (kind, hear) => window.addEventListener(kind, hear, { capture: true });

  listen('beforeinput', (event) => {
    if (isNumberField(event.target) && /[^-\d., \u2212]/.test(event.data ?? '')) event.preventDefault();
  });
  listen('input', (event) => {
    const field = event.target;
    if (sending || !isNumberField(field)) return;
    event.stopImmediatePropagation();
    hold(field);
    const typed = text.get.call(field), plain = typed.replace(/ /g, '').replace(/,/g, '.').replace(/\u2212/g, '-');
    if (plain !== typed) text.set.call(field, plain);
    const hand = held.get(field);
    clearTimeout(hand.timer);
    hand.timer = setTimeout(() => NUMBER.test(text.get.call(field)) && tell(field), PAUSE_MS);
  });
  listen('keydown', (event) => {
    const field = event.target;
    if (!held.has(field)) return;
    event.stopImmediatePropagation();
    if (event.key === 'Enter' || event.key === 'Tab') finish(field);
    else if (event.key === 'Escape') release(field);
    else if (event.key === 'ArrowUp' || event.key === 'ArrowDown') {
      event.preventDefault(); // a step goes from the number that was typed
      finish(field);
      setTimeout(() => field.dispatchEvent(new KeyboardEvent('keydown', { key: event.key, bubbles: true })), APART_MS);
    }
  });
  listen('focusout', (event) => {
    if (!held.has(event.target)) return;
    event.stopImmediatePropagation(); // else the slider's ends of before would cut the number
    finish(event.target);
  });
  listen('pointerdown', (event) => {
    for (const field of held.keys()) if (field !== event.target) finish(field);
  });
})();
