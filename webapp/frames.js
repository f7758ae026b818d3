// Frames of the 3D view: actuators move here, and only what has changed is drawn. viser draws for a quarter of a second after
// each message, and once a second in any case; on a machine without a graphics card one frame takes as long. A page that
// is not used comes to rest: after REST_MS they stand still, until the mouse moves or something is asked.
//
// Private parts of viser, React and three.js that are used here, why, and where it could be had upstream (files of
// src/viser/client/src in viser-project/viser, unless said otherwise). All are found through `window.__viserMutable`
// (App.tsx), which viser gives its own end-to-end tests.
// - `scene.__r3f.root` (react-three-fiber's `getRootState`): the renderer and `invalidate`; viser could hand out both in
//   ViewerContext.ts.
// - `gl.render` is replaced: viser draws each frame that is asked for, whether anything has changed or not; a setting of
//   <Canvas frameloop> and a test for change in App.tsx would do.
// - `requestRender` is replaced: it says that a message has changed the view; an event in MessageHandler.tsx would do.
// - `getRenderRequestState` is read: pictures that Python asks for are drawn in any case (MessageHandler.tsx).
// - `nodePoseData`, `nodeRefFromName`: poses set in the page, 25 a second and none sent; an animation of a node in
//   SceneTree.tsx would do.
// - `messageQueue`, `drainMessageQueue`: arrows get other ends by a script, as by a message of their own; one message for
//   several nodes in WebsocketMessages.ts would do.
// - the material of outlines is changed: only its far side is drawn; a property `side` of arrows (Arrows.tsx) would do.
// - `cameraControl`: the camera goes along with a node; "follow a node" in CameraControls of App.tsx would do.
// - the shader of labels is changed, by its text: labels of a dark theme; a colour of labels in label/LabelRenderer.tsx
//   would do.
// - `preventDefault` of a press on the canvas is emptied: SceneTree.tsx calls it for nodes that can be dragged, from a
//   listener that react-three-fiber has made passive, and the browser writes an error each time.
(() => {
  if (window.finlabFrames) return;
  const REST_MS = 30000, LOOKED_AT_MS = 4000; // after the last touch
  const QUICK_MS = 40, SLOW_MS = 70; // between frames, just after a touch and later
  const SETTLE_MS = 230; // a little less than viser's own
  const SLOW = 0.5; // propellers turn no faster than in slow motion: they would seem to turn back
  const LONGEST_STEP_S = 0.2; // a long pause must not become a leap
  const FIRST_MS = 50; // where drawing is slow, words and numbers that have come are painted before the picture
  const WORK_MS = 1000; // for so long after a key or a press beside the view actuators stand still there
  const TIMED_EVERY = 15, MOST_COST_MS = 200; // frames, and what one may count as: the first takes longer
  const SPACING = 1.4; // between frames that take long, in times of one
  const LABELS_MS = 600; // labels of new actuators are drawn where they are with the picture after the first
  const PICTURE = 2; // pixels of a saved picture per pixel of the page
  const APART = 1.9; // between the phases of fins, which look alive so

  let parts = [], blades = [], robots = [], speed = 1, frozen = true, phases = [], turns = [];
  let touched = performance.now(), due = 0, drawnAt = -Infinity, drawn = [], timer = 0, stepped = 0, cost = 0, worked = -Infinity, over = false;
  const viewer = () => window.__viserMutable;
  const root = () => viewer()?.scene?.__r3f?.root.getState();

  // What is drawn, and when.

  function patch() {
    const { gl } = root() ?? {};
    if (!gl || gl.finlab) return;
    gl.finlab = true;
    const draw = gl.render.bind(gl);
    gl.render = (scene, camera) => {
      if (scene !== viewer().scene || gl.getRenderTarget() || viewer().getRenderRequestState !== 'ready') return draw(scene, camera);
      camera.updateMatrixWorld();
      const now = performance.now();
      const seen = [...camera.matrixWorld.elements, ...camera.projectionMatrix.elements, gl.domElement.width, gl.domElement.height];
      const moved = seen.some((value, k) => value !== drawn[k]);
      const settling = now < due + QUICK_MS && now >= free(), settled = drawnAt < due && now >= due;
      if (!moved && !settling && !settled) return;
      drawn = seen;
      drawnAt = now;
      paint(scene);
      draw(scene, camera);
      if (++window.finlabFrames.count % TIMED_EVERY || now - worked < WORK_MS) return;
      const context = gl.getContext();
      context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4)); // when it is there
      cost = Math.min(performance.now() - now, MOST_COST_MS);
    };
    gl.domElement.addEventListener('webglcontextrestored', ask);
  }

  // Labels are black on white in viser, whatever the theme.
  const night = { value: 0 };
  const OUTLINE = /\/(halo|asked_force)$/, FAR_SIDE = 1; // names of nodes; BackSide of three.js
  function paint(scene) {
    for (const [name, node] of Object.entries(viewer().nodeRefFromName)) {
      if (!OUTLINE.test(name)) continue;
      node?.traverse(({ material }) => {
        if (material && material.side !== FAR_SIDE) Object.assign(material, { side: FAR_SIDE, needsUpdate: true });
      });
    }
    night.value = Number(document.documentElement.dataset.mantineColorScheme === 'dark');
    scene.traverse(({ material }) => {
      if (!material?.uniforms?.uLabelData || material.finlab) return;
      Object.assign(material, { finlab: true, needsUpdate: true });
      material.uniforms.night = night;
      material.fragmentShader = `uniform float night;\n${material.fragmentShader}`
        .replace('vec4(1.0, 1.0, 1.0,', 'vec4(vec3(1.0 - 0.86 * night),')
        .replace('vec4(0.0, 0.0, 0.0,', 'vec4(vec3(0.9 * night),');
    });
  }

  // The camera goes along with a robot that swims, wherever it is turned or moved to.
  let stood = null;
  function follow() {
    const now = stood && viewer().nodePoseData['/robot']?.position, before = stood;
    if (!now) return;
    stood = [...now];
    const [x, y, z] = now.map((value, k) => value - before[k]);
    if (!x && !y && !z) return;
    const controls = viewer().cameraControl, target = controls.getTarget(controls.camera.position.clone());
    controls.moveTo(target.x - y, target.y + z, target.z - x, false); // z is up in viser, y in three.js
  }

  // Where a frame takes long, time is left to the rest of the page, and what a user asks for goes first.
  const slow = () => cost > QUICK_MS;
  const typing = () => !over && document.activeElement?.matches('input, textarea'); // the next key is not to wait for a frame
  const free = () => drawnAt + (slow() ? SPACING * cost : QUICK_MS);
  function ask() {
    const now = performance.now();
    due = now + SETTLE_MS;
    if (slow() && now >= free()) drawnAt = now + FIRST_MS - SPACING * cost;
  }

  function listenToRequests() {
    const view = viewer(), request = view.requestRender;
    if (request.finlab) return;
    view.requestRender = Object.assign(() => { follow(); ask(); request(); }, { finlab: true });
  }

  function touch(event) {
    touched = performance.now();
    if (event) over = event.type.startsWith('pointer') && event.target.tagName === 'CANVAS';
    if (event && event.type !== 'pointermove' && event.target.tagName !== 'CANVAS') worked = touched;
    due = Math.max(due, touched + 2 * QUICK_MS); // what the pointer is over may look otherwise
    beat();
  }

  // How actuators move, each a list: half amplitude, frequency, angle, turns of its propeller per second, and the
  // axis of that.

  const alive = () => !frozen && speed > 0 && parts.some(([amplitude, frequency, , spin]) => amplitude * frequency > 0 || spin)
    && robots.some((name) => viewer()?.nodeRefFromName[name]?.visible !== false);

  function turn(name, axis, angle) {
    const node = viewer().nodePoseData[name] ??= { position: [0, 0, 0] };
    node.wxyz = [Math.cos(angle / 2), 0, 0, 0];
    node.wxyz[1 + axis] = Math.sin(angle / 2);
    if (node.poseUpdateState !== 'waitForMakeObject') node.poseUpdateState = 'needsUpdate';
  }

  function pose() {
    parts.forEach(([amplitude, , angle, spin, axis], k) => {
      const blade = blades[k];
      turn(blade, 0, frozen ? angle : angle + amplitude * Math.sin(phases[k]));
      if (spin) turn(`${blade}/propeller`, axis, turns[k]);
    });
    due = Math.max(due, performance.now() + 1);
    root()?.invalidate();
  }

  function beat() {
    if (timer || document.hidden || !alive()) return;
    const since = performance.now() - touched;
    if (since > REST_MS) return;
    const pause = since < LOOKED_AT_MS ? QUICK_MS : SLOW_MS;
    timer = setTimeout(() => requestAnimationFrame(() => {
      timer = 0;
      if (slow() && typing()) return;
      const now = performance.now(), elapsed = Math.min((now - stepped) / 1000, LONGEST_STEP_S);
      stepped = now;
      const on = 2 * Math.PI * elapsed;
      parts.forEach(([, frequency, , spin], k) => {
        phases[k] = (phases[k] + on * frequency * speed) % (2 * Math.PI);
        turns[k] = (turns[k] + on * spin * Math.min(speed, SLOW)) % (2 * Math.PI);
      });
      if (alive()) pose();
      beat();
    }), slow() ? Math.max(pause, worked + WORK_MS - performance.now()) : pause);
  }

  // The view as a picture, twice as fine as on the screen, without what lies over it.
  function picture(name) {
    const { gl, scene, camera } = root(), fine = gl.getPixelRatio();
    gl.setPixelRatio(PICTURE);
    drawn = [];
    due = performance.now();
    drawnAt = -Infinity;
    gl.render(scene, camera);
    gl.domElement.toBlob((blob) => {
      const link = Object.assign(document.createElement('a'), { href: URL.createObjectURL(blob), download: name });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
    gl.setPixelRatio(fine);
    ask();
  }

  window.finlabFrames = {
    count: 0, // frames that were drawn
    picture,
    follow(start) { stood = start; },
    // A node stands elsewhere: told with what lets actuators move, it needs no message of its own.
    place(name, position) {
      const node = viewer().nodePoseData[name] ??= { wxyz: [1, 0, 0, 0] };
      node.position = position;
      if (node.poseUpdateState !== 'waitForMakeObject') node.poseUpdateState = 'needsUpdate';
      due = Math.max(due, performance.now() + 1);
      root()?.invalidate();
    },
    // Arrows end elsewhere, with the picture of all that is told with this script.
    point(name, owner, points) {
      const view = viewer();
      view.messageQueue.push({ type: 'SceneNodeUpdateMessage', name, owner, updates: { points: new Float32Array(points) } });
      view.drainMessageQueue?.();
    },
    // Counts: how many of the commands are for each robot, by the name of its node.
    flap(commands, rate, still, counts = { '/robot': commands.length }) {
      patch();
      listenToRequests();
      if (commands.length !== parts.length) {
        [phases, turns] = [commands.map((_, k) => APART * k), commands.map(() => 0)];
        setTimeout(() => { ask(); root()?.invalidate(); }, LABELS_MS);
      }
      [parts, speed, frozen] = [commands, rate, still];
      robots = Object.keys(counts);
      blades = robots.flatMap((name) => [...Array(counts[name]).keys()].map((k) => `${name}/fins/${k}/turn/blade`));
      stepped = performance.now();
      pose();
      touch();
    },
  };
  for (const kind of ['pointermove', 'pointerdown', 'pointerup', 'wheel', 'keydown', 'keyup'])
    window.addEventListener(kind, touch, { capture: true, passive: true });
  // For what can be dragged, viser asks this of a listener that may not.
  window.addEventListener('pointerdown', (event) => {
    if (event.target.tagName === 'CANVAS') event.preventDefault = () => {};
  }, { capture: true });
  document.addEventListener('visibilitychange', () => { ask(); touch(); });
})();
