// The core in C (finlab/core/core.h) as WebAssembly: one robot, questions and answers.
const math = { atan2: Math.atan2, cos: Math.cos, sin: Math.sin, exp: Math.exp, tanh: Math.tanh };
const POLICIES = ["closest", "direction", "priority"];

export async function loadCore(url) {
  const { instance } = await WebAssembly.instantiateStreaming(fetch(url), { env: math });
  return instance.exports;
}

// A robot's block (Float64Array) and n actuators, ready for questions.
export function prepare(core, block, n) {
  const most = core.fl_sizes(6), bytes = [8 * block.length, core.fl_sizes(3), core.fl_sizes(4), 80, core.fl_sizes(5)];
  let end = core.__heap_base.value;
  const places = bytes.map((size) => { const at = (end + 15) & ~15; end = at + size; return at; });
  const [robot, work, policy, question, answer] = places;
  const pages = Math.ceil(end / 65536) - core.memory.buffer.byteLength / 65536;
  if (pages > 0) core.memory.grow(pages);
  const doubles = (at, count) => new Float64Array(core.memory.buffer, at, count);
  const whole = (at, count) => new Int32Array(core.memory.buffer, at, count);
  doubles(robot, block.length).set(block);
  const error = core.fl_check(robot, block.length) || core.fl_prepare(robot, work);
  if (error) throw new Error(`the core refused the robot: error ${error}`);
  return (wrench, served = "closest", groups = []) => {
    whole(policy, 2).set([POLICIES.indexOf(served), groups.length]);
    doubles(policy + 8, 6).fill(1);
    new Uint8Array(core.memory.buffer, policy + 56, 36).set(groups.flat());
    doubles(question, 6).set(wrench);
    whole(question + 48, 8).set([policy, 0, 0, 0, 0, 0, 0, 0]); // nothing lost, no axis free, no tick before
    const code = core.fl_answer_one(robot, work, question, answer);
    if (code) throw new Error(`the core refused the question: error ${code}`);
    const numbers = doubles(answer, 5 * most + 20), flags = whole(answer + 8 * (5 * most + 20), 5);
    const rows = (from, width) => Array.from({ length: n }, (_, i) => [...numbers.slice(from + i * width, from + (i + 1) * width)]);
    const force = rows(0, 2);
    const power = force.map((f, i) => core.cost_at(robot, i, f[1] === 0 ? f[0] : Math.hypot(...f)));
    return { force, power, command: rows(2 * most + 20, 3), wrench: [...numbers.slice(2 * most + 12, 2 * most + 18)], within: flags[1] === 1 };
  };
}
