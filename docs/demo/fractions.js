// Exact fractions, by integers of any size.
const gcd = (a, b) => {
  while (b) [a, b] = [b, a % b];
  return a;
};

export class Fraction {
  constructor(numerator, denominator = 1n) {
    if (denominator === 0n) throw new Error("a fraction has the denominator 0");
    const divisor = gcd(numerator < 0n ? -numerator : numerator, denominator < 0n ? -denominator : denominator);
    const sign = denominator < 0n ? -1n : 1n;
    this.numerator = (sign * numerator) / divisor;
    this.denominator = (sign * denominator) / divisor;
  }

  // Of a decimal such as "-1.5e-3", or of a fraction such as "2/3".
  static of(text) {
    if (typeof text !== "string") throw new Error(`expected a number as text, got ${typeof text}`);
    const [, exponent] = /e([-+]?\d+)$/i.exec(text) ?? [];
    if (text.length >= 5000 || Math.abs(Number(exponent ?? 0)) >= 40) throw new Error(`a number is out of range: ${text.slice(0, 40)}`);
    const ratio = /^([-+]?\d+)\/(\d+)$/.exec(text);
    if (ratio) return new Fraction(BigInt(ratio[1]), BigInt(ratio[2]));
    const decimal = /^([-+]?)(\d*)(?:\.(\d*))?(?:e[-+]?\d+)?$/i.exec(text);
    if (!decimal || !(decimal[2] || decimal[3])) throw new Error(`no number: ${text.slice(0, 40)}`);
    const [, sign, whole, part = ""] = decimal;
    const digits = BigInt(sign + (whole + part));
    const shift = BigInt(exponent ?? 0) - BigInt(part.length);
    return shift < 0n ? new Fraction(digits, 10n ** -shift) : new Fraction(digits * 10n ** shift);
  }

  plus(other) {
    return new Fraction(this.numerator * other.denominator + other.numerator * this.denominator, this.denominator * other.denominator);
  }

  times(other) {
    return new Fraction(this.numerator * other.numerator, this.denominator * other.denominator);
  }

  over(other) {
    return new Fraction(this.numerator * other.denominator, this.denominator * other.numerator);
  }

  minus(other) {
    return this.plus(other.negative());
  }

  negative() {
    return new Fraction(-this.numerator, this.denominator);
  }

  size() {
    return this.sign() < 0 ? this.negative() : this;
  }

  // -1, 0 or 1.
  sign() {
    return this.numerator < 0n ? -1 : Number(this.numerator > 0n);
  }

  isBelow(other) {
    return this.minus(other).sign() < 0;
  }

  isAtMost(other) {
    return this.minus(other).sign() <= 0;
  }

  equals(other) {
    return this.numerator === other.numerator && this.denominator === other.denominator;
  }

  // The nearest number of 53 bits, but for its last bits.
  toNumber() {
    const digits = 25n;
    const shift = BigInt(this.denominator.toString().length - this.numerator.toString().length) + digits;
    const scaled = shift > 0n ? (this.numerator * 10n ** shift) / this.denominator : this.numerator / (this.denominator * 10n ** -shift);
    return Number(`${scaled}e${-shift}`);
  }
}

export const ZERO = new Fraction(0n);
export const ONE = new Fraction(1n);
export const sum = (values) => values.reduce((total, value) => total.plus(value), ZERO);
export const largest = (values) => values.reduce((best, value) => (best.isBelow(value) ? value : best));
export const smallest = (values) => values.reduce((best, value) => (value.isBelow(best) ? value : best));

// The largest integer whose square is at most n, by Newton's method.
function integerRoot(n) {
  if (n < 0n) throw new Error("a root of a negative number");
  if (n < 2n) return n;
  let root = 1n << BigInt((n.toString(2).length + 1) >> 1);
  for (;;) {
    const next = (root + n / root) >> 1n;
    if (next >= root) return root;
    root = next;
  }
}

const FINE = 10n ** 30n; // square roots are rounded to this part of one

export const rootBelow = (x) => new Fraction(integerRoot((x.numerator * FINE * FINE) / x.denominator), FINE);
export const rootAbove = (x) => rootBelow(x).plus(new Fraction(1n, FINE));
