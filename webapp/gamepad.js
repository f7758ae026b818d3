// A gamepad asks for a wrench (`panels/gamepad.py`): two sticks, the triggers and the bumpers are its six axes, each from
// -1 to 1. While nothing is held the page sends nothing, so sliders are free. At most one message in PAUSE_MS is sent.
(() => {
  if (window.finlabGamepad) return;
  const PAUSE_MS = 50, DEAD = 0.15, DIGITS = 2;
  const LOOK_MS = 500; // between two looks whether a gamepad is there
  const button = (pad, place) => pad.buttons[place]?.value ?? 0;
  // Fx, Fy, Fz, Tx, Ty, Tz. Sticks are negative where they are pushed ahead or to the left; the body's y points left.
  const axesOf = (pad) => [
    -(pad.axes[1] ?? 0), -(pad.axes[0] ?? 0), -(pad.axes[3] ?? 0),
    button(pad, 7) - button(pad, 6), button(pad, 5) - button(pad, 4), -(pad.axes[2] ?? 0),
  ];
  // Beyond the dead zone the value begins at zero again.
  const beyond = (value) => {
    const size = Math.min(Math.max((Math.abs(value) - DEAD) / (1 - DEAD), 0), 1);
    return Number((Math.sign(value) * size).toFixed(DIGITS)) || 0;
  };
  let commanded = [true, true, true, true, true, true], words = [], last = '', timer = 0, sign = null, named = '';

  const found = () => [...(navigator.getGamepads?.() ?? [])].find((pad) => pad?.connected) ?? null;

  function show(pad) {
    const name = pad ? `${pad.id} ${commanded} ${words}` : '';
    if (name === named) return;
    named = name;
    sign?.remove();
    sign = null;
    if (!pad) return;
    sign = Object.assign(document.createElement('div'), { className: 'fl fl-gamepad' });
    sign.setAttribute('role', 'status');
    sign.title = pad.id;
    const title = Object.assign(document.createElement('b'), { textContent: 'Gamepad' });
    sign.append(title, ...words.filter((_, axis) => commanded[axis]).map((text) =>
      Object.assign(document.createElement('span'), { textContent: text })));
    document.body.append(sign);
  }

  function look() {
    const pad = found();
    show(pad);
    if (pad) {
      const values = axesOf(pad).map((value, axis) => (commanded[axis] ? beyond(value) : 0));
      const text = values.join(' '), isHeld = values.some(Boolean);
      if (text !== last && (isHeld || last)) window.finlabPresses?.tell('gamepad', text, '');
      last = isHeld ? text : '';
    } else if (last) { // it was unplugged while a stick was held
      window.finlabPresses?.tell('gamepad', '0 0 0 0 0 0', '');
      last = '';
    }
    timer = setTimeout(look, pad ? PAUSE_MS : LOOK_MS);
  }

  window.finlabGamepad = {
    begin(axes, hints) {
      [commanded, words] = [axes, hints];
      timer ||= setTimeout(look, 0);
    },
  };
})();
