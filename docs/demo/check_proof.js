// Checks a file of `finlab layout prove`, as finlab/analysis/check_proof.py does, which says why a proof is one.
import { Fraction, ONE, ZERO, largest, rootBelow, smallest, sum } from "./fractions.js";

const AXES = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"];
const UNIT_MARGIN = Fraction.of("1e-9");
const FINE = Fraction.of("1e-30");
const TWO = Fraction.of("2");
const THREE = Fraction.of("3");
const LINE = [[[ONE, ZERO], [ONE, ZERO]]]; // the sectors of an actuator of one axis

export class WrongProof extends Error {}

function need(condition, words) {
  if (!condition) throw new WrongProof(words);
}

const isAtLeast = (a, b) => b.isAtMost(a);
const isPositive = (x) => x.sign() > 0;
const isNegative = (x) => x.sign() < 0;
const negated = (p) => p.map((x) => x.negative());

// Vectors.

const dot = (a, b) => {
  need(a.length === b.length, "two lists differ in length");
  return sum(a.map((x, k) => x.times(b[k])));
};
// Of vectors in a plane: positive where b lies to the left of a.
const cross = (a, b) => a[0].times(b[1]).minus(a[1].times(b[0]));
const lengthAbove = (a) => rootBelow(dot(a, a)).plus(FINE);
const difference = (a, b) => a.map((x, k) => x.minus(b[k]));

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

// Sets of forces.

// The sectors of an actuator, ahead and astern: from u to v, least and largest force, and its sign.
function sidesOf({ sectors }, [low, high]) {
  const ahead = sectors.map(([u, v]) => ({ u, v, least: largest([low, ZERO]), most: high, sign: 1 }));
  if (!isNegative(low)) return ahead;
  const astern = sectors.map(([u, v]) => ({ u: negated(u), v: negated(v), least: ZERO, most: low.negative(), sign: -1 }));
  return [...ahead, ...astern];
}

// Whether p lies in the directions of a sector.
function isToward({ u, v }, p) {
  const isWide = isPositive(cross(u, v)) || isNegative(dot(u, v)); // else both are one direction
  const isBetween = !isNegative(cross(u, p)) && !isNegative(cross(p, v));
  return isBetween && (isWide || !isNegative(dot(u, p)));
}

// Whether a sector has the force p, or one of its direction that is larger.
const reaches = (side, p) => isToward(side, p) && dot(p, p).isAtMost(side.most.times(side.most));

// Whether sectors have the forces between 0, a and b, but for small ones. The way from a to b is cut
// where a sector ends; one sector has both ends of each piece.
function holdTriangle(sides, a, b) {
  if (cross(a, b).sign() === 0) return [a, b].every((p) => sides.some((side) => reaches(side, p)));
  const shares = [ZERO, ONE];
  for (const end of sides.flatMap(({ u, v }) => [u, v])) {
    const [before, after] = [cross(a, end), cross(end, b)];
    if (before.sign() * after.sign() > 0) shares.push(before.over(before.plus(after)));
  }
  shares.sort((x, y) => x.minus(y).sign());
  const points = shares.map((share) => a.map((x, k) => x.plus(share.times(b[k].minus(x)))));
  return points.slice(1).every((q, k) => sides.some((side) => reaches(side, points[k]) && reaches(side, q)));
}

// Whether all between a and b are as long as the least force.
function isFar(a, b, least) {
  const along = difference(b, a);
  const square = least.times(least);
  if (isNegative(dot(a, along)) && isPositive(dot(b, along))) {
    const area = cross(a, b);
    return isAtLeast(area.times(area), square.times(dot(along, along)));
  }
  return isAtLeast(smallest([dot(a, a), dot(b, b)]), square);
}

// Whether p is a mean of forces of a sector: beyond the chord of least ones at both ends.
function isMean(side, p) {
  const { u, v, least } = side;
  const normal = [v[1].minus(u[1]), u[0].minus(v[0])];
  const isBeyond = isAtLeast(dot(normal, p), least.times(cross(u, v)));
  return reaches(side, p) && isBeyond && (isPositive(cross(u, v)) || isAtLeast(dot(p, p), least.times(least)));
}

const compare = (a, b) => difference(a, b).map((x) => x.sign()).find((sign) => sign !== 0) ?? 0;

// The corners of the convex hull of points, counterclockwise: its lower chain, then its upper one.
function hullOf(points) {
  const inOrder = [...points].sort(compare).filter((p, k, all) => k === 0 || compare(p, all[k - 1]) !== 0);
  const chainOf = (ordered) => {
    const chain = [];
    for (const p of ordered) {
      while (chain.length > 1 && !isPositive(turn(chain.at(-2), chain.at(-1), p))) chain.pop();
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  const corners = [...chainOf(inOrder), ...chainOf([...inOrder].reverse())];
  return corners.length ? corners : inOrder;
}

// Positive where c lies to the left of the way from a to b.
const turn = (a, b, c) => cross(difference(b, a), difference(c, a));

// Whether sectors of an actuator have the convex hull of some forces.
function holdHull(actuator, sides, points) {
  const least = largest([actuator.force_n[0], ZERO]);
  const isHeld = isPositive(least);
  if (actuator.mean && isHeld) return sides.some((side) => points.every((p) => isMean(side, p)));
  const corners = hullOf(points);
  const edges = corners.map((a, k) => [a, corners[(k + 1) % corners.length]]);
  if (isHeld && edges.every(([a, b]) => isPositive(cross(a, b)))) return false; // around 0
  if (isHeld && !edges.every(([a, b]) => isFar(a, b, least))) return false;
  return edges.every(([a, b]) => holdTriangle(sides, a, b));
}

// An upper bound of price.p over forces p of a sector with sizes from low to high.
function mostGain(side, price, low, high) {
  if (isToward(side, price)) return high.times(lengthAbove(price));
  const gains = [side.u, side.v].map((edge) => {
    const along = dot(price, edge); // an edge is no shorter than 1
    return isPositive(along) ? high.times(along) : low.times(along).over(lengthAbove(edge));
  });
  return largest(gains);
}

// Power.

// The power of a force by the chord between two points of the curve.
function wattsAt(points, size) {
  const following = points.slice(1, -1).findIndex(([x]) => size.isAtMost(x));
  const last = following < 0 ? points.length - 1 : following + 1;
  const [[x0, p0], [x1, p1]] = [points[last - 1], points[last]];
  return p0.plus(p1.minus(p0).times(size.minus(x0)).over(x1.minus(x0)));
}

// An upper bound of the power of a force, convex in it; astern too unless all are ahead.
function mostWatts(actuator, force, isAhead) {
  const { points } = actuator.power;
  if (actuator.axes.length === 1) return wattsAt(points, force[0]);
  const size = largest([lengthAbove(force), actuator.force_n[0]]); // means are of forces so large
  const watts = wattsAt(points, size);
  return isAhead ? watts : largest([watts, wattsAt(points, size.negative())]);
}

// An upper bound of price.p - wattPrice P(p) over the forces p of a sector.
function mostProfit({ power }, side, price, wattPrice) {
  if (wattPrice.sign() === 0) return mostGain(side, price, side.least, side.most);
  const gain = mostGain(side, price, ZERO, ONE); // per newton
  const own = power.points.filter(([x]) => side.sign * x.sign() >= 0);
  return largest(own.map(([x, watts]) => gain.times(x.size()).minus(wattPrice.times(watts.minus(power.error_w)))));
}

// What a file says.

function checkActuator(actuator) {
  const { name, axes, sectors, mean } = actuator;
  need(axes.length === 1 || axes.length === 2, `${name}: one or two axes`);
  for (const a of axes) need(dot(a, a).minus(ONE).size().isBelow(UNIT_MARGIN), `${name}: its axes are no unit vectors`);
  need(axes.length === 1 || dot(...axes).size().isBelow(UNIT_MARGIN), `${name}: its axes are skew`);
  const [least, most] = pairOf(actuator.force_n);
  const [low, high] = pairOf(actuator.outer_force_n);
  const isInOrder = low.isAtMost(least) && least.isAtMost(most) && most.isAtMost(high) && !isNegative(most);
  need(isInOrder, `${name}: its forces are in no order`);
  for (const [u, v] of sectors.map(pairOf)) {
    for (const edge of [u, v]) {
      const square = dot(edge, edge);
      need(isAtLeast(square, ONE) && square.isBelow(TWO), `${name}: a direction is too short, or too long`);
      need(edge.length === 2, `${name}: a direction has two numbers`);
    }
    need(!isNegative(cross(u, v)), `${name}: a sector is wider than half a turn`);
  }
  const isLine = axes.length === 1 && sectors.length === 1 && sectors[0].every((edge) => compare(edge, LINE[0][0]) === 0);
  need(isLine || (axes.length === 2 && sectors.length > 0), `${name}: its sectors are not those of its axes`);
  need(!mean || !isPositive(low) || sectors.length === 1, `${name}: means of its forces may lie between its sectors`);
  if (actuator.power !== null) checkPower(name, actuator.power, smallest([low, ZERO]), high);
}

function pairOf(values) {
  need(values.length === 2, "expected two of a kind");
  return values;
}

function checkPower(name, { points, error_w: error }, low, high) {
  const slopes = points.slice(1).map(([x1, p1], k) => {
    const [x0, p0] = points[k];
    need(x0.isBelow(x1), `${name}: the points of its power do not rise`);
    const slope = p1.minus(p0).over(x1.minus(x0));
    const risesAhead = !isNegative(slope) && !isNegative(x0);
    const risesAstern = !isPositive(slope) && !isPositive(x1);
    need(risesAhead || risesAstern, `${name}: its power falls`);
    return slope;
  });
  need(slopes.slice(1).every((slope, k) => slopes[k].isAtMost(slope)), `${name}: its power is not convex`);
  const isWide = slopes.length > 0 && points[0][0].isAtMost(low) && high.isAtMost(points.at(-1)[0]);
  need(isWide && !isNegative(error), `${name}: its power is not known`);
}

// The actuators by name, with their columns, and the statement with the half widths of its box.
function checkedRobot(proof) {
  need(proof.format === "finlab-proof" && proof.version.equals(THREE), "no proof of version 3");
  const { statement } = proof;
  const { box, free } = statement;
  const names = AXES.filter((axis) => axis in box);
  const others = AXES.filter((axis) => !(axis in box));
  const isComplete = free.length === others.length && others.every((axis, k) => free[k] === axis);
  need(isComplete && names.length === Object.keys(box).length, "free axes are others");
  const halfWidths = names.map((axis) => box[axis]);
  need(names.length > 0 && !isNegative(smallest(halfWidths)), "the box has no size");
  need(!isNegative(statement.wrench_tolerance), "the tolerance is negative");
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

const withValue = (values, i, value) => values.map((each, k) => (k === i ? value : each));
const keyOf = (names) => JSON.stringify([...new Set(names)].sort());

// Whether there is each case, and its box is given.
function checkProved(cases, robot) {
  const { actuators, statement } = robot;
  need(cases.every(({ lost }) => Array.isArray(lost)), "a case has no list of who is lost");
  const caseOf = new Map(cases.map((each) => [keyOf(each.lost), each]));
  const high = statement.halfWidths;
  for (let n = 0; n <= Number(statement.lost.numerator); n++) {
    for (const lost of subsetsOf([...actuators.keys()], n)) {
      need(caseOf.has(keyOf(lost)), `no case in which ${lost.join(", ") || "nobody"} is lost`);
      checkBox(caseOf.get(keyOf(lost)), lost, negated(high), high, robot);
    }
  }
}

function checkBox(box, lost, low, high, robot) {
  const { actuators, statement } = robot;
  if ("axis" in box) {
    const [i, at] = [statement.names.indexOf(box.axis), Fraction.of(box.at)];
    need(i >= 0 && low[i].isBelow(at) && at.isBelow(high[i]), "a box is split outside of it");
    checkBox(box.below, lost, low, withValue(high, i, at), robot);
    checkBox(box.above, lost, withValue(low, i, at), high, robot);
    return;
  }
  const who = `lost ${lost.join(", ") || "nobody"}`;
  const working = [...actuators.values()].filter(({ name }) => !lost.includes(name));
  const forcesOf = new Map(working.map(({ name }) => [name, []]));
  for (const [corner, wrench] of cornersOf(low, high)) {
    const where = `${who}, corner ${corner}`;
    need(corner in box.corners, `${where}: is missing`);
    const forces = box.corners[corner];
    need(Object.keys(forces).length === working.length && working.every(({ name }) => Object.hasOwn(forces, name)), `${where}: not the forces of those left`);
    let missing = wrench;
    for (const { name, columns } of working) {
      const force = forces[name].map((text) => Fraction.of(text));
      need(force.length === columns.length, `${where}: ${name} has other axes`);
      force.forEach((size, k) => (missing = missing.map((w, row) => w.minus(size.times(columns[k][row])))));
      forcesOf.get(name).push([...force, ZERO].slice(0, 2));
    }
    need(missing.every((w) => w.size().isAtMost(statement.wrench_tolerance)), `${where}: the wrench is another`);
  }
  for (const actuator of working) {
    need(holdHull(actuator, sidesOf(actuator, actuator.force_n), forcesOf.get(actuator.name)), `${who}: ${actuator.name} cannot push so`);
  }
  if (statement.power_w === null) return;
  const watts = wattsOfCorners(working, forcesOf);
  need(watts.every((each) => each.isAtMost(statement.power_w)), `${who}: takes more power`);
}

// Upper bounds of the power of each corner.
function wattsOfCorners(working, forcesOf) {
  const byActuator = working.map((actuator) => {
    const points = forcesOf.get(actuator.name);
    const ahead = sidesOf(actuator, actuator.force_n).filter(({ sign }) => sign > 0);
    const isAhead = holdHull(actuator, ahead, points);
    return points.map((p) => mostWatts(actuator, p, isAhead));
  });
  return byActuator.length ? byActuator[0].map((_, k) => sum(byActuator.map((watts) => watts[k]))) : [ZERO];
}

// Whether a wrench of the box is out of reach.
function checkRefuted({ lost, wrench: written, tree }, robot) {
  const { actuators, statement } = robot;
  const few = BigInt(new Set(lost).size) <= statement.lost.numerator && lost.every((name) => actuators.has(name));
  need(few, "others are lost than the statement says");
  const { names, halfWidths } = statement;
  need(Object.keys(written).length === names.length && names.every((axis) => Object.hasOwn(written, axis)), "the wrench has other axes");
  const wrench = names.map((axis) => Fraction.of(written[axis]));
  need(wrench.every((w, k) => w.size().isAtMost(halfWidths[k])), "the wrench is not in the box");
  const working = [...actuators.values()].filter(({ name }) => !lost.includes(name));
  const sides = new Map(working.map((actuator) => [actuator.name, sidesOf(actuator, actuator.outer_force_n)]));
  checkTree(tree, wrench, sides, robot);
}

// A price, or the name of an actuator, and a tree for each of its sectors.
function checkTree(tree, wrench, sides, robot) {
  if ("price" in tree) return checkPrice(tree, wrench, sides, robot);
  need(sides.has(tree.cut), `${tree.cut}: is not there`);
  const own = sides.get(tree.cut);
  need(own.length === tree.each.length, `${tree.cut}: a sector has no price`);
  own.forEach((side, k) => checkTree(tree.each[k], wrench, new Map(sides).set(tree.cut, [side]), robot));
}

function checkPrice({ price, watt_price: wattPrice }, wrench, sides, { actuators, statement }) {
  const budget = statement.power_w;
  need(budget === null ? wattPrice.sign() === 0 : wattPrice.sign() >= 0, "no such price per watt");
  const value = dot(price, wrench).minus(statement.wrench_tolerance.times(sum(price.map((y) => y.size()))));
  const profits = [...sides].map(([name, ownSides]) => {
    const actuator = actuators.get(name);
    const ownPrice = [...actuator.columns.map((column) => dot(price, column)), ZERO].slice(0, 2);
    return largest(ownSides.map((side) => mostProfit(actuator, side, ownPrice, wattPrice)));
  });
  need(sum([wattPrice.times(budget ?? ZERO), ...profits]).isBelow(value), "the price does not separate the wrench");
}

// Reading a file, and saying what it proves.

// The values of a file, with fractions in place of its numbers. JSON has no way to see the digits of a
// number, so that each becomes a text behind a mark that no text of a file may have.
function read(text) {
  need(!/\u0001|\\u0001/i.test(text), "a letter that is none");
  const quoted = text.replace(/"(?:[^"\\]|\\.)*"|-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][-+]?\d+)?/g, (word) => (word[0] === '"' ? word : `"\\u0001${word}"`));
  const values = JSON.parse(quoted, (key, value) => (typeof value === "string" && value[0] === "\u0001" ? Fraction.of(value.slice(1)) : value));
  needEachKeyOnce(quoted);
  return values;
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

// What a file states.
function sentence({ actuators, statement }) {
  const box = Object.entries(statement.box).map(([axis, half]) => `${axis} +-${shown(half)}`).join(", ");
  const free = statement.free.length ? `, ${statement.free.join(", ")} free` : "";
  const budget = statement.power_w === null ? "" : `, within ${shown(statement.power_w)} W`;
  const near = statement.wrench_tolerance.sign() ? `, to within ${shown(statement.wrench_tolerance)}` : "";
  const means = [...actuators.values()].filter(({ mean }) => mean).map(({ name }) => name);
  const mean = means.length ? `; small forces as means over time: ${means.join(", ")}` : "";
  return `any wrench of ${box}${free}, any ${statement.lost.numerator} lost${budget}${near}${mean}`;
}

// Returns the verdict of a file's text, in a sentence; throws an error where it proves nothing.
export function check(text) {
  const proof = read(text);
  const robot = checkedRobot(proof);
  if (proof.verdict === "refuted") checkRefuted(proof.counterexample, robot);
  else {
    need(proof.verdict === "proved", "no verdict");
    checkProved(proof.cases, robot);
  }
  return `${proof.verdict}: ${sentence(robot)}`;
}
