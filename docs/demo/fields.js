// The structs of the core as JavaScript sees them, made of the text that the core itself gives (finlab/core/fl_fields.h).
const SIZES = {
  fl_real: 8, fl_byte: 1, int: 4, fl_reals: 4, fl_bytes: 4, fl_policy_at: 4, fl_budget_at: 4, fl_offset_at: 4, fl_question_at: 4,
  fl_work_at: 4, fl_row_at: 4, fl_flag_at: 4,
};
const VIEWS = { fl_real: Float64Array, fl_byte: Uint8Array, int: Int32Array };

const upTo = (place, size) => Math.ceil(place / size) * size;

// A text of the core that lies at an address.
function textAt(core, address) {
  const bytes = new Uint8Array(core.memory.buffer, address);
  return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
}

// { FL_FIN: 2, "sizeof fl_work": 12345, ... }: the constants of finlab.h, and bytes of structs.
export function constantsOf(core) {
  const constants = {};
  for (let k = 0; ; k++) {
    const name = core.fl_constant_name(k);
    if (name === 0) return constants;
    constants[textAt(core, name)] = core.fl_constant_value(k);
  }
}

// { fl_answer: { size, force: { at, count, type }, ... }, ... }; places and sizes in bytes.
export function structsOf(core) {
  const text = textAt(core, core.fl_fields());
  const structs = {};
  for (const line of text.trim().split("\n")) {
    const [name, ...rest] = line.split(" ");
    const struct = { size: 0 };
    let widest = 1;
    for (const [, type, field, shape] of rest.join(" ").matchAll(/(\w+) (\w+)((?:\[\d+\])*);/g)) {
      const count = (shape.match(/\d+/g) ?? []).reduce((product, length) => product * length, 1);
      const at = upTo(struct.size, SIZES[type]);
      struct[field] = { at, count, type };
      struct.size = at + count * SIZES[type];
      widest = Math.max(widest, SIZES[type]);
    }
    struct.size = upTo(struct.size, widest);
    structs[name] = struct;
  }
  return structs;
}

// A field of a struct that lies at an address, as a view of the core's memory; addresses are whole numbers.
export function fieldAt(core, address, { at, count, type }) {
  const View = VIEWS[type] ?? Uint32Array;
  return new View(core.memory.buffer, address + at, count);
}
