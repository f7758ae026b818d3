// The core in C (finlab/core/finlab.h) as WebAssembly: one robot, questions and answers.
import { constantsOf, fieldAt, structsOf } from "./fields.js";

const math = {
  atan2: Math.atan2, cos: Math.cos, exp: Math.exp, log: Math.log, pow: Math.pow, sin: Math.sin, tanh: Math.tanh,
};

export async function loadCore(url) {
  const { instance } = await WebAssembly.instantiateStreaming(fetch(url), { env: math });
  return instance.exports;
}

// Places behind the program for things of so many bytes; memory grows to hold them.
function placesFor(core, sizes) {
  let end = core.__heap_base.value;
  const places = sizes.map((size) => {
    const at = (end + 15) & ~15;
    end = at + size;
    return at;
  });
  const pages = Math.ceil(end / 65536) - core.memory.buffer.byteLength / 65536;
  if (pages > 0) core.memory.grow(pages);
  return places;
}

// A robot's block (Float64Array) and n actuators, ready for questions.
export function prepare(core, block, n) {
  const { fl_policy, fl_question, fl_answer } = structsOf(core);
  const constants = constantsOf(core);
  const sizes = [8 * block.length, constants["sizeof fl_work"], fl_policy.size, fl_question.size, fl_answer.size, n];
  const [robot, work, policy, question, answer, losses] = placesFor(core, sizes);
  new Float64Array(core.memory.buffer, robot, block.length).set(block);
  const error = core.fl_check(robot, block.length) || core.fl_prepare(robot, work);
  if (error) throw new Error(`the core refused the robot: error ${error}`);

  const asked = (field) => fieldAt(core, question, fl_question[field]);
  const served = (field) => fieldAt(core, policy, fl_policy[field]);
  const answered = (field) => [...fieldAt(core, answer, fl_answer[field])];
  const rows = (field, width) => {
    const numbers = answered(field);
    return Array.from({ length: n }, (_, i) => numbers.slice(i * width, (i + 1) * width));
  };
  // Of the actuators the one whose number is `lost` does not work; -1 for none. Its rows are null.
  return (wrench, kind = "closest", groups = [], lost = -1) => {
    served("kind")[0] = constants[`FL_${kind.toUpperCase()}`];
    served("group_count")[0] = groups.length;
    served("axis_weight").fill(1);
    served("group").set(groups.flat());
    new Uint8Array(core.memory.buffer, question, fl_question.size).fill(0); // no axis free, no tick
    asked("wrench").set(wrench);
    asked("policy")[0] = policy;
    asked("lost")[0] = losses;
    new Uint8Array(core.memory.buffer, losses, n).fill(0).fill(1, lost < 0 ? n : lost, lost + 1);
    const code = core.fl_answer_one(robot, work, question, answer);
    if (code) throw new Error(`the core refused the question: error ${code}`);
    const force = rows("force", 2);
    const command = rows("command", 3);
    const power = force.map(([first, second], i) => {
      const size = second === 0 ? first : Math.hypot(first, second);
      return core.fl_power_of_force(robot, i, size);
    });
    if (lost >= 0) for (const each of [force, command, power]) each[lost] = null;
    const [within] = answered("is_attainable");
    return { force, power, command, wrench: answered("wrench_served"), within: within === 1 };
  };
}
