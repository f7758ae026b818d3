// Turns the axes in the corner of the view with the camera.
(() => {
  if (window.finlabTriad) return;
  window.finlabTriad = true;
  const LENGTH = 25, TURN = [0, 1, 2, 4, 5, 6, 8, 9, 10];
  let drawn = [];
  function draw() {
    requestAnimationFrame(draw);
    const svg = document.querySelector('.triad'), view = window.__viserMutable;
    const robot = view?.nodeRefFromName?.['/robot'], camera = view?.camera;
    if (!svg || !robot || !camera) return;
    const c = camera.matrixWorldInverse.elements, r = robot.matrixWorld.elements;
    const same = (value, k) => Math.abs(value - drawn[k]) < 1e-3;
    if (svg.dataset.drawn && TURN.every((k) => same(c[k], k) && same(r[k], 16 + k))) return;
    drawn = [...c, ...r];
    svg.dataset.drawn = '1';
    const arms = [...svg.querySelectorAll('.axis')];
    const depths = new Map();
    for (const arm of arms) {
      const k = 'xyz'.indexOf(arm.classList[1]);
      const [x, y, z] = r.slice(4 * k, 4 * k + 3);
      const seen = [0, 1, 2].map((row) => c[row] * x + c[4 + row] * y + c[8 + row] * z);
      const u = LENGTH * seen[0], v = -LENGTH * seen[1];
      arm.querySelector('line').setAttribute('x2', u);
      arm.querySelector('line').setAttribute('y2', v);
      for (const part of arm.querySelectorAll('circle, text')) part.setAttribute('transform', `translate(${u} ${v})`);
      depths.set(arm, seen[2]);
    }
    // The nearest one is drawn last; only where the order changes, so that a click meets what it was aimed at.
    const order = [...arms].sort((a, b) => depths.get(a) - depths.get(b));
    if (order.some((arm, k) => arm !== arms[k])) for (const arm of order) svg.append(arm);
  }
  draw();
})();
