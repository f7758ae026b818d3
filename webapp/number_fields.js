// A box for a number is the user's own while it has the focus: nothing is written into it, and nothing half-typed
// leaves it. Enter, Tab, a click elsewhere or a rest of a second send the text to the server, which reads it
// (number_fields.py) and answers what is to stand there. viser's own boxes would send every key, and round it.
(() => {
  if (window.finlabFields) return;
  const REST_MS = 1000; // a text that stands this long is meant
  const PATIENCE_MS = 15000; // without an answer for so long the box shows again what is in force
  const value = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value');
  const held = new Map(); // boxes in the user's hands, or with a text that was refused
  let channel = null, known = new Set(), last = 0, unheard = [];

  // The name of a box's handle, and which of its boxes it is; nothing for inputs that are none of ours.
  function nameOf(box) {
    if (!(box instanceof HTMLInputElement) || !box.classList.contains('mantine-NumberInput-input')) return null;
    let row = box.parentElement;
    while (row && !row.querySelector('label[for]')) row = row.parentElement;
    const uuid = row?.querySelector('label[for]').htmlFor;
    if (!known.has(uuid)) return null;
    return [uuid, [...row.querySelectorAll('input.mantine-NumberInput-input')].indexOf(box)];
  }

  function hold(box) {
    if (held.has(box)) return held.get(box);
    // React watches its inputs by a property of their own; while it cannot write, it keeps what it wants to write
    // in the attribute `value`.
    const watched = Object.getOwnPropertyDescriptor(box, 'value') ?? value;
    const hand = { watched, name: nameOf(box), dirty: false, rested: false, refused: false, sent: 0, timer: 0 };
    held.set(box, hand);
    Object.defineProperty(box, 'value', { configurable: true, get: () => value.get.call(box), set: () => {} });
    box.setSelectionRange = () => {}; // the framework would bring the caret back after a selection of the user's
    return hand;
  }

  function release(box, text) {
    const hand = held.get(box);
    clearTimeout(hand.timer);
    held.delete(box);
    box.removeAttribute('aria-invalid');
    delete box.setSelectionRange;
    Object.defineProperty(box, 'value', hand.watched);
    hand.watched.set.call(box, text ?? box.defaultValue);
  }

  function send(box, how, text) {
    const hand = held.get(box);
    clearTimeout(hand.timer);
    hand.sent = ++last;
    unheard.push([hand.sent, ...hand.name, how, text]);
    window.__viserMutable?.sendMessage?.(
      { type: 'GuiUpdateMessage', uuid: channel, updates: { value: JSON.stringify(unheard) } });
    setTimeout((number) => {
      unheard = unheard.filter((word) => word[0] !== number);
      if (hand.sent === number && held.get(box) === hand && document.activeElement !== box) release(box);
    }, PATIENCE_MS, hand.sent);
  }

  function finish(box) {
    const text = value.get.call(box).trim();
    send(box, text ? 'enter' : 'empty', text);
  }

  function rest(box) {
    const text = value.get.call(box).trim();
    if (!text) return;
    held.get(box).rested = true;
    send(box, 'pause', text);
  }

  function settle(box, hand, refused, shown, how) {
    hand.sent = 0;
    hand.refused = refused;
    if (refused) box.setAttribute('aria-invalid', 'true');
    else box.removeAttribute('aria-invalid');
    if (how === 'pause') return; // the number is taken, the text is still the user's
    hand.dirty = hand.rested = false;
    if (refused) return; // the text stays to be corrected
    if (document.activeElement === box) value.set.call(box, shown);
    else release(box, shown);
  }

  window.finlabFields = {
    start(uuid, fields) {
      channel = uuid; known = new Set(fields); last = 0; unheard = [];
      held.clear(); // of a page that was built before
    },
    answer(answers) {
      for (const [number, refused, shown] of answers) {
        const word = unheard.find((other) => other[0] === number);
        for (const [box, hand] of held)
          if (hand.sent === number) settle(box, hand, refused, shown, word?.[3]);
      }
      const heard = Math.max(...answers.map((answer) => answer[0]));
      unheard = unheard.filter((word) => word[0] > heard);
    },
    drop(uuid) {
      for (const [box, hand] of held)
        if (hand.refused && hand.name[0] === uuid && document.activeElement !== box) release(box);
    },
  };

  const listen = (kind, hear) =>
    window.addEventListener(kind, (event) => hear(event, event.target), { capture: true });

  listen('focusin', (event, box) => {
    for (const other of held.keys()) if (!other.isConnected) held.delete(other);
    if (!nameOf(box)) return;
    event.stopImmediatePropagation(); // else the framework takes the focus back when the answer is there
    box.inputMode = 'text'; // a phone's keyboard of digits has no units
    hold(box);
  });
  listen('input', (event, box) => {
    if (!nameOf(box)) return;
    event.stopImmediatePropagation();
    const hand = hold(box);
    hand.dirty = true;
    clearTimeout(hand.timer);
    hand.timer = setTimeout(rest, REST_MS, box);
  });
  listen('change', (event, box) => {
    if (held.has(box)) event.stopImmediatePropagation();
  });
  listen('keydown', (event, box) => {
    const hand = held.get(box);
    if (!hand || event.ctrlKey || event.metaKey || event.altKey || event.key === 'Tab') return;
    event.stopImmediatePropagation();
    if (event.key === 'Enter' && hand.dirty) finish(box);
    else if (event.key === 'Escape') send(box, 'escape', hand.rested ? 'rested' : '');
    else if (event.key === 'ArrowUp' || event.key === 'ArrowDown') {
      event.preventDefault();
      if (hand.dirty) finish(box); // a step goes from what was typed
      send(box, 'step', event.key === 'ArrowUp' ? '1' : '-1');
    }
  });
  listen('focusout', (event, box) => {
    const hand = held.get(box);
    if (!hand) return;
    event.stopImmediatePropagation(); // else the slider's ends of before would cut the number
    if (hand.dirty) finish(box);
    else if (!hand.sent && !hand.refused) release(box);
  });
  listen('pointerdown', (event, target) => {
    for (const box of held.keys()) if (document.activeElement === box && box !== target) box.blur();
  });
})();
