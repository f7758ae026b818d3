// Checks a file of `finlab layout prove`, as finlab/analysis/check_proof.py does, which says why a proof is one.
import { Fraction, ONE, ZERO, largest, rootAbove, rootBelow, smallest, sum } from "./fractions.js";

const AXES = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"];
const TEXTS = ["format", "name", "type", "free", "verdict", "layout", "axis", "cut", "remarks", "mean"];
const UNIT_MARGIN = Fraction.of("1e-9");
const TWO = Fraction.of("2");
const FOUR = Fraction.of("4");

export class WrongProof extends Error {}

function need(condition, words) {
  if (!condition) throw new WrongProof(words);
}

const isAtLeast = (a, b) => b.isAtMost(a);
const dot = (a, b) => {
  need(a.length === b.length, "two lists differ in length");
  return sum(a.map((x, k) => x.times(b[k])));
};
const cross = (a, b) => a[0].times(b[1]).minus(a[1].times(b[0]));
const power = (x, n) => Array.from({ length: n }).reduce((product) => product.times(x), ONE);
const allOf = (set, members) => members.every((member) => set.has(member));

// The values of a file, with fractions in place of its numbers; numbers are kept as their text until then.
function valuesOf(text) {
  const quoted = text.replace(/"(?:[^"\\]|\\.)*"|-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][-+]?\d+)?/g, (word) => (word[0] === '"' ? word : `"${word}"`));
  const values = JSON.parse(quoted);
  needEachKeyOnce(quoted);
  return withFractions(values, "");
}

// Of what a key says twice JavaScript sees one, and a reader perhaps another. `text` is JSON.
function needEachKeyOnce(text) {
  const open = [];
  for (const [word, inside, colon] of text.matchAll(/[{}]|"((?:[^"\\]|\\.)*)"(\s*:)?/g)) {
    if (word === "{") open.push(new Set());
    else if (word === "}") open.pop();
    else if (colon) {
      const key = JSON.parse(`"${inside}"`);
      need(!open.at(-1).has(key), `the key ${key} stands twice`);
      open.at(-1).add(key);
    }
  }
}

function withFractions(value, key) {
  if (Array.isArray(value)) return key === "lost" || TEXTS.includes(key) ? value : value.map((item) => withFractions(item, ""));
  if (value !== null && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([name, item]) => [name, withFractions(item, name)]));
  return typeof value === "string" && !TEXTS.includes(key) ? Fraction.of(value) : value;
}

// size^exponent by repeated square roots, rounded as `root` and `leftover` (smallest or largest) are.
function raised(size, exponent, root, leftover) {
  const whole = Number(exponent.numerator / exponent.denominator);
  let result = power(size, whole);
  let rest = exponent.minus(Fraction.of(String(whole)));
  for (let k = 0; k < 20; k++) {
    if (rest.sign() === 0) return result;
    size = root(size);
    rest = rest.times(TWO);
    if (isAtLeast(rest, ONE)) {
      result = result.times(size);
      rest = rest.minus(ONE);
    }
  }
  return result.times(leftover([ONE, size]));
}

// The wrench of 1 N along each axis a of an actuator at r: a, then r x a + k a.
function columnsOf(actuator) {
  const [x, y, z] = actuator.position_m;
  const k = actuator.torque_per_newton_m;
  return actuator.axes.map((a) => {
    need(a.length === 3, "an axis has three numbers");
    const lever = [y.times(a[2]).minus(z.times(a[1])), z.times(a[0]).minus(x.times(a[2])), x.times(a[1]).minus(y.times(a[0]))];
    return [...a, ...lever.map((torque, i) => torque.plus(k.times(a[i])))];
  });
}

const turnsLeft = ([a, b]) => cross(a, b).sign() >= 0;
const isLine = ([a, b]) => cross(a, b).sign() === 0 && dot(a, b).sign() > 0;

function inArc(arc, p) {
  const [a, b] = arc;
  const [first, last] = [cross(a, p).sign() >= 0, cross(p, b).sign() >= 0];
  if (!turnsLeft(arc)) return first || last;
  return first && last && (!isLine(arc) || dot(a, p).sign() >= 0);
}

const isWithin = ([a, b], whole) => inArc(whole, a) && inArc([a, whole[1]], b);
const isWide = (arcs) => arcs === null || arcs.some((arc) => cross(...arc).sign() <= 0 && !isLine(arc));
const sameDirection = (a, b) => a.length === b.length && a.every((x, k) => x.equals(b[k]));
const sameArcs = (a, b) => a.length === b.length && a.every((arc, k) => arc.length === b[k].length && arc.every((edge, i) => sameDirection(edge, b[k][i])));

function checkEdges(arcs) {
  for (const edge of arcs.flat()) {
    const square = dot(edge, edge);
    need(isAtLeast(square, ONE) && square.isBelow(TWO), "a direction of an arc is too short, or too long");
  }
}

function checkActuator(actuator) {
  const { name, axes } = actuator;
  need(axes.length === 1 || axes.length === 2, `${name}: one or two axes`);
  for (const a of axes) need(dot(a, a).minus(ONE).size().isBelow(UNIT_MARGIN), `${name}: its axes are no unit vectors`);
  need(axes.length === 1 || dot(...axes).size().isBelow(UNIT_MARGIN), `${name}: its axes are skew`);
  const [least, most] = pairOf(actuator.force_n);
  need(least.isAtMost(most) && most.sign() >= 0, `${name}: limits of the force are in no order`);
  checkEdges(actuator.arcs ?? []);
  const [low, high] = pairOf(actuator.outer_force_n);
  need(low.isAtMost(least) && isAtLeast(high, most), `${name}: the outer forces are too few`);
  const held = actuator.mean && isWide(actuator.arcs);
  need(low.sign() <= 0 || !held, `${name}: the outer forces are too few`);
  if (actuator.power === null) return;
  if ("points" in actuator.power) checkPoints(actuator, low, high);
  else {
    const { forward, reverse, exponent } = actuator.power;
    need(forward.sign() >= 0 && reverse.sign() >= 0, `${name}: its power is negative`);
    need(ONE.isAtMost(exponent) && exponent.isAtMost(FOUR), `${name}: its power is not convex`);
  }
}

function pairOf(values) {
  need(values.length === 2, "expected two numbers");
  return values;
}

function checkPoints({ name, axes, power: { points, error_w: error } }, low, high) {
  const slopes = points.slice(1).map(([x1, p1], k) => {
    const [x0, p0] = points[k];
    need(x0.isBelow(x1), `${name}: the points of its power do not rise`);
    return p1.minus(p0).over(x1.minus(x0));
  });
  need(slopes.slice(1).every((slope, k) => slopes[k].isAtMost(slope)), `${name}: its power is not convex`);
  const isLineOfForces = axes.length === 1;
  const [first] = points[0];
  const [last] = points[points.length - 1];
  const rises = isLineOfForces || (slopes[0].sign() >= 0 && first.sign() === 0);
  need(rises && smallest(points.map(([, p]) => p)).sign() >= 0, `${name}: its power falls with the force`);
  need(first.isAtMost(smallest([low, ZERO])) || !isLineOfForces, `${name}: its power is not known`);
  const farthest = isLineOfForces ? high : largest([high, low.negative()]);
  need(isAtLeast(last, farthest) && error.sign() >= 0, `${name}: its power is not known`);
}

// A convex part of an actuator's forces: a line, all forces up to some size, forces ahead, or (`sign` -1) astern.
function convexPart(actuator, part) {
  const { name, arcs: whole } = actuator;
  const [least, most] = actuator.force_n;
  const { line } = part;
  if (line !== undefined) {
    const onArc = whole === null || whole.some((arc) => inArc(arc, line));
    need(onArc && dot(line, line).sign() > 0, `${name}: the line is in no arc`);
    return { line };
  }
  if ("disc" in part) {
    need(least.sign() <= 0 && isWide(whole), `${name}: does not push in all directions`);
    return { sides: ["forward", "reverse"], sign: 1, arc: null, most: smallest([most, least.negative()]), normal: [ZERO, ZERO], bound: ZERO };
  }
  if ("astern" in part) {
    need(least.sign() <= 0, `${name}: does not push astern`);
    return { sides: ["reverse"], sign: -1, ...partBounds({ ...actuator, force_n: [ZERO, least.negative()] }, part) };
  }
  return { sides: ["forward"], sign: 1, ...partBounds(actuator, part) };
}

// The arc, the largest force, and n, c with n.p >= c, of forces p ahead.
function partBounds(actuator, part) {
  const { name, arcs: whole } = actuator;
  const [least, most] = actuator.force_n;
  const arc = part.arc ?? (whole && whole.length === 1 ? whole[0] : null);
  need(arc !== null || whole === null, `${name}: has several arcs, and no part`);
  if (arc !== null) {
    need(arc.length === 2 && turnsLeft(arc), `${name}: its arc is not convex`);
    checkEdges([arc]);
    need(whole === null || whole.some((each) => isWithin(arc, each)), `${name}: the part is not within its arcs`);
  }
  if (least.sign() <= 0 || (actuator.mean && arc === null)) return { arc, most, normal: [ZERO, ZERO], bound: ZERO };
  if (actuator.mean && !isLine(arc)) {
    const [a, b] = arc;
    return { arc, most, normal: [b[1].minus(a[1]), a[0].minus(b[0])], bound: least.times(cross(a, b)) };
  }
  need("ahead" in part, `${name}: cannot push so little, and has no part`);
  need(dot(part.ahead, part.ahead).isAtMost(ONE), `${name}: ahead is longer than 1`);
  return { arc, most, normal: part.ahead, bound: least };
}

function inPart(actuator, part, force) {
  if (actuator.axes.length === 1) {
    const [least, most] = actuator.force_n;
    return least.isAtMost(force[0]) && force[0].isAtMost(most);
  }
  need(force.length === 2, "a force of a plane has two numbers");
  const square = dot(force, force);
  if (part.line !== undefined) {
    const [least, farthest] = actuator.force_n;
    const end = dot(part.line, force).sign() >= 0 ? farthest : smallest([least, ZERO]);
    return cross(part.line, force).sign() === 0 && least.sign() <= 0 && square.isAtMost(end.times(end));
  }
  const { sign, arc, most, normal, bound } = part;
  const ahead = sign < 0 ? force.map((p) => p.negative()) : force;
  const isAhead = (arc === null || inArc(arc, ahead)) && isAtLeast(dot(normal, ahead), bound);
  return isAhead && square.isAtMost(most.times(most));
}

// The laws of power that may be those of a force.
function sidesOf(part, force) {
  if (part !== undefined && part.line === undefined) return part.sides;
  const along = part === undefined ? force[0] : dot(part.line, force);
  return along.sign() < 0 ? ["reverse"] : ["forward"];
}

// An upper bound of the power of a force of a part, undefined of one along a line.
function mostWatts(actuator, force, part) {
  const law = actuator.power;
  const isPlane = force.length === 2;
  let size = isPlane ? rootAbove(dot(force, force)) : force[0].size();
  if (isPlane) size = largest([size, actuator.force_n[0]]);
  if (!("points" in law)) {
    const factor = largest(sidesOf(part, force).map((side) => law[side]));
    return factor.times(raised(size, law.exponent, rootAbove, largest));
  }
  const x = isPlane ? size : force[0];
  let i = 1;
  for (let j = 1; j < law.points.length - 1; j++) if (law.points[j][0].isAtMost(x)) i = j + 1;
  const [[x0, p0], [x1, p1]] = [law.points[i - 1], law.points[i]];
  return p0.plus(p1.minus(p0).over(x1.minus(x0)).times(x.minus(x0)));
}

// An upper bound of price.p over forces p from low to high along the directions of arcs.
function mostGain(arcs, price, low, high) {
  if (arcs === null || arcs.some((arc) => inArc(arc, price))) return high.times(rootAbove(dot(price, price)));
  const gains = arcs.flat().map((edge) => {
    const along = dot(price, edge);
    const isLoss = along.sign() < 0 && low.sign() > 0;
    return isLoss ? low.times(along).over(rootAbove(dot(edge, edge))) : high.times(along);
  });
  return largest(low.sign() > 0 ? gains : [ZERO, ...gains]);
}

// An upper bound of price.f - wattPrice P(f) over all forces f of an actuator.
function mostProfit(actuator, price, wattPrice, touch) {
  const { arcs, power: law } = actuator;
  const [low, high] = actuator.outer_force_n;
  const back = price.map((c) => c.negative());
  const isLineOfForces = actuator.axes.length === 1;
  if (wattPrice.sign() === 0) {
    if (isLineOfForces) return largest([price[0].times(low), price[0].times(high)]);
    const gain = mostGain(arcs, price, low, high);
    return low.sign() >= 0 ? gain : largest([gain, mostGain(arcs, back, ZERO, low.negative())]);
  }
  const sides = isLineOfForces ? [[price[0], high, "forward"], [back[0], low.negative(), "reverse"]] : [[mostGain(arcs, price, ZERO, ONE), high, "forward"]];
  if (!isLineOfForces && low.sign() < 0) sides.push([mostGain(arcs, back, ZERO, ONE), low.negative(), "reverse"]);
  if ("points" in law) {
    const along = isLineOfForces ? price[0] : largest(sides.map(([gain]) => gain));
    return largest(law.points.map(([x, p]) => along.times(x).minus(wattPrice.times(p.minus(law.error_w)))));
  }
  const bounds = sides.map(([gain, farthest, side]) => {
    const bound = largest([ZERO, gain.times(farthest)]); // at no power, and by the tangent at `touch`:
    if (touch.sign() <= 0) return bound;
    const e = law.exponent;
    const watts = law[side].times(raised(touch, e, rootBelow, smallest));
    const atEnd = gain.minus(wattPrice.times(e).times(watts).over(touch)).times(farthest);
    return smallest([bound, largest([ZERO, atEnd]).plus(wattPrice.times(e.minus(ONE)).times(watts))]);
  });
  return largest([ZERO, ...bounds]);
}

// The actuators by name, with their columns, and the statement with the half widths of its box.
function checkedPremises(proof) {
  need(proof.format === "finlab-proof" && proof.version.equals(TWO), "no proof of version 2");
  const { statement } = proof;
  const { box, free } = statement;
  const names = AXES.filter((axis) => axis in box);
  const others = AXES.filter((axis) => !(axis in box));
  const isComplete = free.length === others.length && others.every((axis, k) => free[k] === axis);
  need(isComplete && names.length === Object.keys(box).length, "free axes are others");
  const halfWidths = names.map((axis) => box[axis]);
  need(names.length > 0 && smallest(halfWidths).sign() >= 0, "the box has no size");
  need(statement.wrench_tolerance.sign() >= 0, "the tolerance is negative");
  const actuators = new Map(proof.actuators.map((actuator) => [actuator.name, actuator]));
  need(actuators.size === proof.actuators.length, "two actuators have one name");
  const lost = statement.lost;
  need(lost.denominator === 1n && lost.sign() >= 0 && lost.numerator <= BigInt(actuators.size), "more are lost than there are");
  for (const actuator of actuators.values()) {
    checkActuator(actuator);
    need(statement.power_w === null || actuator.power !== null, `${actuator.name}: its power is not known`);
    actuator.columns = columnsOf(actuator).map((column) => names.map((axis) => column[AXES.indexOf(axis)]));
  }
  return { actuators, statement: { ...statement, names, halfWidths } };
}

function* subsetsOf(names, count) {
  if (count === 0) yield [];
  else for (let k = 0; k + count <= names.length; k++) for (const rest of subsetsOf(names.slice(k + 1), count - 1)) yield [names[k], ...rest];
}

function* cornersOf(low, high) {
  if (low.length === 0) yield ["", []];
  else {
    const ends = low[0].isBelow(high[0]) ? [["+", high[0]], ["-", low[0]]] : [["0", low[0]]];
    for (const [sign, value] of ends) for (const [signs, values] of cornersOf(low.slice(1), high.slice(1))) yield [sign + signs, [value, ...values]];
  }
}

const ownValue = (values, name) => (Object.hasOwn(values, name) ? values[name] : undefined);
const withValue = (values, i, value) => values.map((each, k) => (k === i ? value : each));
const keyOf = (names) => JSON.stringify([...new Set(names)].sort());

function checkBox(box, lost, low, high, { actuators, statement }) {
  const premises = { actuators, statement };
  if ("axis" in box) {
    const [i, at] = [statement.names.indexOf(box.axis), box.at];
    need(i >= 0 && low[i].isBelow(at) && at.isBelow(high[i]), "a box is split outside of it");
    checkBox(box.below, lost, low, withValue(high, i, at), premises);
    checkBox(box.above, lost, withValue(low, i, at), high, premises);
    return;
  }
  const working = [...actuators.values()].filter(({ name }) => !lost.includes(name));
  const parts = new Map(working.filter(({ axes }) => axes.length === 2).map((actuator) => [actuator.name, convexPart(actuator, ownValue(box.parts, actuator.name) ?? {})]));
  for (const [corner, wrench] of cornersOf(low, high)) {
    const where = `lost ${lost.join(", ") || "nobody"}, corner ${corner}`;
    need(corner in box.corners, `${where}: is missing`);
    const forces = box.corners[corner];
    need(Object.keys(forces).length === working.length && working.every(({ name }) => Object.hasOwn(forces, name)), `${where}: not the forces of those left`);
    let missing = wrench;
    let watts = ZERO;
    for (const actuator of working) {
      const force = forces[actuator.name];
      need(force.length === actuator.axes.length, `${where}: ${actuator.name} has other axes`);
      need(inPart(actuator, parts.get(actuator.name), force), `${where}: ${actuator.name} cannot push so`);
      force.forEach((size, k) => (missing = missing.map((w, row) => w.minus(size.times(actuator.columns[k][row])))));
      if (statement.power_w !== null) watts = watts.plus(mostWatts(actuator, force, parts.get(actuator.name)));
    }
    need(missing.every((w) => w.size().isAtMost(statement.wrench_tolerance)), `${where}: the wrench is another`);
    need(statement.power_w === null || watts.isAtMost(statement.power_w), `${where}: takes more power`);
  }
}

function checkCounterexample({ lost, wrench: written, tree }, { actuators, statement }) {
  const few = BigInt(new Set(lost).size) <= statement.lost.numerator && allOf(actuators, lost);
  need(few, "others are lost than the statement says");
  const { names, halfWidths } = statement;
  need(Object.keys(written).length === names.length && names.every((axis) => Object.hasOwn(written, axis)), "the wrench has other axes");
  const wrench = names.map((axis) => written[axis]);
  need(wrench.every((w, k) => w.size().isAtMost(halfWidths[k])), "the wrench is not in the box");
  const working = new Map([...actuators].filter(([name]) => !lost.includes(name)));
  checkTree(tree, wrench, working, statement);
}

// A price, or the name of an actuator, pieces of its arcs, and a tree for each of them.
function checkTree(tree, wrench, actuators, statement) {
  if ("price" in tree) return checkPrice(tree, wrench, [...actuators.values()], statement);
  const { cut, arcs: pieces, each } = tree;
  need(actuators.has(cut), `${cut}: is not there`);
  const actuator = actuators.get(cut);
  if ("sides" in tree) {
    const [low, high] = actuator.outer_force_n;
    need(low.sign() <= 0 && tree.sides.length === 2, `${cut}: does not push astern`);
    [[ZERO, high], [low, ZERO]].forEach((ends, k) => checkTree(tree.sides[k], wrench, new Map(actuators).set(cut, { ...actuator, outer_force_n: ends }), statement));
    return;
  }
  need(covers(pieces, actuator.arcs), `${cut}: pieces leave out directions`);
  const hasMeans = actuator.mean && actuator.outer_force_n[0].sign() > 0;
  need(!hasMeans || sameArcs(pieces, actuator.arcs), `${cut}: its arcs cannot be cut`);
  need(each.length === pieces.length, `${cut}: a piece has no price`);
  pieces.forEach((piece, k) => checkTree(each[k], wrench, new Map(actuators).set(cut, { ...actuator, arcs: [piece] }), statement));
}

// Whether each arc is a chain of pieces of at most half a turn, one after the other.
function covers(pieces, arcs) {
  checkEdges(pieces);
  if (arcs === null && pieces.some(isLine)) return false;
  const left = [...pieces];
  for (const [first, last] of arcs ?? [[pieces[0][0], pieces[0][0]]]) {
    let at = first;
    do {
      if (left.length === 0 || !sameDirection(left[0][0], at) || !turnsLeft(left[0])) return false;
      at = left.shift()[1];
    } while (!sameDirection(at, last));
  }
  return left.length === 0;
}

function checkPrice({ price, watt_price: wattPrice, touch }, wrench, actuators, statement) {
  const budget = statement.power_w;
  need(budget === null ? wattPrice.sign() === 0 : wattPrice.sign() >= 0, "no such price per watt");
  const value = dot(price, wrench).minus(statement.wrench_tolerance.times(sum(price.map((y) => y.size()))));
  const profits = actuators.map((actuator) => {
    const own = actuator.columns.map((column) => dot(price, column));
    return mostProfit(actuator, own, wattPrice, ownValue(touch, actuator.name) ?? ZERO);
  });
  need(sum([wattPrice.times(budget ?? ZERO), ...profits]).isBelow(value), "the price does not separate the corner");
}

// A number as people read it, with six digits; it says where it is another.
function shown(fraction) {
  const text = sixDigits(fraction);
  return Fraction.of(text).equals(fraction) ? text : `about ${text}`;
}

function sixDigits(fraction) {
  const value = fraction.toNumber();
  if (value === 0) return "0";
  const [digits, exponent] = value.toExponential(5).split("e").map(Number);
  if (exponent >= -4 && exponent < 6) return String(Number(value.toPrecision(6)));
  const size = String(Math.abs(exponent)).padStart(2, "0");
  return `${digits}e${exponent < 0 ? "-" : "+"}${size}`;
}

// Returns the verdict of a file's text, in a sentence; throws an error where it proves nothing.
export function check(text) {
  const proof = valuesOf(text);
  const premises = checkedPremises(proof);
  const { actuators, statement } = premises;
  const count = Number(statement.lost.numerator);
  if (proof.verdict === "refuted") checkCounterexample(proof.counterexample, premises);
  else {
    need(proof.verdict === "proved", "no verdict");
    const cases = new Map(proof.cases.map((each) => [keyOf(each.lost), each]));
    const low = statement.halfWidths.map((half) => half.negative());
    for (let n = 0; n <= count; n++) {
      for (const lost of subsetsOf([...actuators.keys()], n)) {
        need(cases.has(keyOf(lost)), `no case in which ${lost.join(", ") || "nobody"} is lost`);
        const found = cases.get(keyOf(lost));
        checkBox(found, found.lost, low, statement.halfWidths, premises);
      }
    }
  }
  const box = Object.entries(statement.box).map(([axis, half]) => `${axis} +-${shown(half)}`).join(", ");
  const free = statement.free.length ? `, ${statement.free.join(", ")} free` : "";
  const budget = statement.power_w === null ? "" : `, within ${shown(statement.power_w)} W`;
  const near = statement.wrench_tolerance.sign() ? `, to within ${shown(statement.wrench_tolerance)}` : "";
  const means = [...actuators.values()].filter(({ mean }) => mean).map(({ name }) => name);
  const mean = means.length ? `; small forces as means over time: ${means.join(", ")}` : "";
  return `${proof.verdict}: any wrench of ${box}${free}, any ${count} lost${budget}${near}${mean}`;
}
