// The page of six sliders: state in, one answer of the core, picture and table out.
import { loadCore, prepare } from "./core.js";

const AXES = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"], UNITS = ["N", "N", "N", "N m", "N m", "N m"];
const REPEATS = 20; // of an answer, to time it: browsers round their clocks
const page = document.getElementById("demo"), canvas = page.querySelector("canvas");
const part = (selector) => page.querySelector(selector);
const made = (tag, about = {}, ...inside) => { const node = Object.assign(document.createElement(tag), about); node.append(...inside); return node; };
const number = (value) => (Math.abs(value) < 5e-4 ? "0" : value.toPrecision(3));
const state = { robot: null, wrench: [0, 0, 0, 0, 0, 0], lost: -1, turn: -0.9, tilt: 0.55, answer: null };
let core, robots;

async function choose(name) {
  const robot = robots.find((each) => each.name === name);
  const block = new Float64Array(await (await fetch(`${name}.bin`)).arrayBuffer());
  robot.ask = prepare(core, block, robot.actuators.length);
  Object.assign(state, { robot, lost: -1, wrench: robot.wrench.slice() });
  part(".sliders").replaceChildren(...AXES.map(slider).filter((row) => row));
  answer();
}

function slider(axis, k) {
  const most = state.robot.most[k];
  if (!most) return null;
  const input = made("input", { type: "range", min: -1.3 * most, max: 1.3 * most, step: most / 200, value: state.wrench[k], ariaLabel: `${axis} [${UNITS[k]}]` });
  const shown = made("output", {}, `${number(state.wrench[k])} ${UNITS[k]}`);
  input.addEventListener("input", () => { state.wrench[k] = +input.value; shown.value = `${number(+input.value)} ${UNITS[k]}`; answer(); });
  return made("label", {}, made("span", {}, axis), input, shown);
}

function answer() {
  const { robot, wrench, lost } = state, policy = part("[name=policy]").value;
  const groups = policy === "priority" ? robot.groups : [], ask = () => robot.ask(wrench, policy, groups, lost), got = ask();
  const start = performance.now();
  for (let k = 0; k < REPEATS; k++) ask();
  const spent = (performance.now() - start) / REPEATS;
  state.answer = got;
  const missing = wrench.map((value, k) => (robot.most[k] ? value - got.wrench[k] : 0));
  const watts = got.power.reduce((sum, value) => sum + (value ?? 0), 0);
  const short = AXES.map((axis, k) => [axis, missing[k], k]).filter(([, left, k]) => Math.abs(left) > 1e-4 * robot.most[k]);
  part(".verdict").textContent = (short.length ? `Out of reach; missing ${short.map(([axis, left, k]) => `${axis} ${number(left)} ${UNITS[k]}`).join(", ")}. ` : "Exact. ")
    + `${number(watts)} W. Answered in ${(1e3 * spent).toFixed(0)} µs.`;
  part(".verdict").classList.toggle("short", short.length > 0);
  table();
  draw();
}

function table() {
  const rows = state.robot.actuators.map((actuator, i) => {
    const { force, command, power } = state.answer, off = force[i] === null;
    const name = made("button", { type: "button", title: off ? "Mend it" : "Lose it", ariaPressed: off }, actuator.name);
    name.addEventListener("click", () => { state.lost = off ? -1 : i; answer(); });
    const words = off ? "lost" : actuator.numbers.map(([label, unit], k) => (unit === "rad" && label !== "amplitude" ? `${label} ${((command[i][k] * 180) / Math.PI).toFixed(0)}°` : `${label} ${number(command[i][k])} ${unit}`)).join(", ");
    const cells = [off ? "" : number(Math.hypot(...force[i])), off ? "" : number(power[i])].map((text) => made("td", {}, text));
    return made("tr", {}, made("th", {}, name), made("td", {}, words), ...cells);
  });
  const head = made("tr", {}, ...["actuator", "command", "N", "W"].map((text) => made("th", {}, text)));
  part(".answer").replaceChildren(made("table", {}, head, ...rows));
}

// Body frame to pixels: x forward, y left, z up, seen from where the picture was turned to.
function camera() {
  const { turn, tilt, robot } = state, ratio = devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = width * ratio, canvas.height = height * ratio;
  const [c, s, ct, st] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)], zoom = (0.42 * Math.min(width, height) * ratio) / robot.size;
  return ([x, y, z]) => [canvas.width / 2 + zoom * (c * x - s * y), canvas.height / 2 - zoom * (st * (s * x + c * y) + ct * z)];
}

function draw() {
  if (!state.answer) return;
  const { robot, answer: { force }, wrench } = state, at = camera(), pen = canvas.getContext("2d");
  const style = getComputedStyle(document.querySelector(".md-typeset")), ink = style.color, accent = getComputedStyle(document.body).getPropertyValue("--md-accent-fg-color");
  const line = (points, colour, width) => { pen.beginPath(); points.map(at).forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y))); pen.strokeStyle = colour; pen.lineWidth = width * devicePixelRatio; pen.stroke(); };
  const arrow = (from, along, colour) => {
    const to = from.map((value, k) => value + along[k]), [[x, y], [u, v]] = [at(from), at(to)], way = Math.atan2(v - y, u - x), tip = Math.min(9 * devicePixelRatio, Math.hypot(u - x, v - y));
    line([from, to], colour, 3);
    pen.beginPath(); pen.moveTo(u, v);
    for (const side of [-0.45, 0.45]) pen.lineTo(u - tip * Math.cos(way + side), v - tip * Math.sin(way + side));
    pen.fillStyle = colour; pen.fill();
  };
  // The hull as an ellipsoid: its outline, which is an ellipse, and its waterline.
  const [middle, ...half] = [[0, 0, 0], ...[0, 1, 2].map((axis) => [0, 1, 2].map((k) => (k === axis ? robot.hull[k] / 2 : 0)))].map((point) => at(point.map((value, k) => value + robot.center[k])));
  const [u, v] = [0, 1].map((k) => half.map((end) => end[k] - middle[k])), times = (a, b) => a.reduce((sum, value, k) => sum + value * b[k], 0);
  const wide = Math.sqrt(times(u, u)), lean = times(u, v) / wide, high = Math.sqrt(times(v, v) - lean * lean);
  const ring = (right, down) => { pen.beginPath(); for (let k = 0; k < 60; k++) { const [c, s] = [Math.cos((k * Math.PI) / 30), Math.sin((k * Math.PI) / 30)]; pen.lineTo(middle[0] + right[0] * c + right[1] * s, middle[1] + down[0] * c + down[1] * s); } pen.closePath(); };
  pen.fillStyle = pen.strokeStyle = ink; pen.lineWidth = devicePixelRatio;
  pen.globalAlpha = 0.08; ring([wide, 0], [lean, high]); pen.fill();
  pen.globalAlpha = 0.4; pen.stroke(); ring(u, v); pen.stroke();
  pen.globalAlpha = 1;
  pen.font = `${12 * devicePixelRatio}px sans-serif`;
  robot.actuators.forEach((actuator, i) => {
    const [x, y] = at(actuator.position), off = force[i] === null, radius = 4 * devicePixelRatio;
    pen.beginPath(); pen.arc(x, y, radius, 0, 7); pen.fillStyle = off ? "#d55e00" : ink; pen.fill();
    pen.textAlign = x > 0.8 * canvas.width ? "right" : "left";
    pen.fillText(actuator.name, x + (x > 0.8 * canvas.width ? -1.6 : 1.6) * radius, y + (i % 2 ? 4 : -1.6) * radius);
    if (off) return;
    const push = [0, 1, 2].map((k) => actuator.directions.reduce((sum, way, q) => sum + way[k] * force[i][q], 0));
    if (Math.hypot(...push) > 1e-3 * robot.strongest) arrow(actuator.position, push.map((value) => (0.9 * robot.size * value) / robot.strongest), accent);
  });
  const [x0, y0] = at([0, 0, 0]);
  pen.textAlign = "left";
  ["x", "y", "z"].forEach((name, k) => { // the body frame, in a corner
    const [x, y] = at([0, 1, 2].map((each) => (each === k ? 0.17 * robot.size : 0))), dx = x - x0, dy = y - y0, cx = 46 * devicePixelRatio, cy = canvas.height - cx;
    pen.beginPath(); pen.moveTo(cx, cy); pen.lineTo(cx + dx, cy + dy); pen.strokeStyle = pen.fillStyle = ["#d55e00", "#009e73", "#0072b2"][k]; pen.lineWidth = 2 * devicePixelRatio; pen.stroke();
    pen.fillText(name, cx + 1.25 * dx - 3, cy + 1.25 * dy + 4);
  });
  const pull = wrench.slice(0, 3).map((value) => (robot.size * value) / Math.max(...robot.most.slice(0, 3)));
  if (Math.hypot(...pull) > 1e-3 * robot.size) arrow([0, 0, 0], pull, "#009e73");
}

canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
canvas.addEventListener("pointermove", (event) => {
  if (!event.buttons) return;
  state.turn += event.movementX / 150;
  state.tilt = Math.min(Math.max(state.tilt + event.movementY / 150, -1.5), 1.5);
  draw();
});
new ResizeObserver(draw).observe(canvas);
new MutationObserver(draw).observe(document.body, { attributeFilter: ["data-md-color-scheme"] });

[core, robots] = await Promise.all([loadCore("finlab.wasm"), fetch("robots.json").then((got) => got.json())]);
part("[name=robot]").append(...robots.map(({ name }) => new Option(name)));
part("[name=policy]").append(new Option("out of reach: closest", "closest"), new Option("out of reach: same direction", "direction"), new Option("out of reach: by priority", "priority"));
part("[name=robot]").addEventListener("change", (event) => choose(event.target.value));
part("[name=policy]").addEventListener("change", answer);
part("[name=rest]").addEventListener("click", () => { state.robot.wrench = [0, 0, 0, 0, 0, 0]; choose(state.robot.name); });
await choose(robots[0].name);
