/* Functions of vectors of LANES numbers, beside those that the file that includes this one defines
   for their width. No guard, as lanes_vector.h has none. */

static inline vector dot_three(const vector *a, const vector *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross_of(const vector *a, const vector *b, vector *product) {
  product[0] = a[1] * b[2] - a[2] * b[1];
  product[1] = a[2] * b[0] - a[0] * b[2];
  product[2] = a[0] * b[1] - a[1] * b[0];
}

#ifdef FL_SINGLE
#define LARGEST_EXPONENT 80 /* to which those of exponentials are limited */
#else
#define LARGEST_EXPONENT 700
#endif

#ifdef FL_SINGLE
static inline vector exp_of(vector x) {
  return EXP(clipped(x, -LARGEST_EXPONENT, LARGEST_EXPONENT));
}
#else
#define PER_LOG_2 1.4426950408889634
/* log 2 in two parts, of which products of the first with integers up to 2^11 are exact. */
#define LOG_2_HIGH 0.6931471805598903
#define LOG_2_LOW 5.497923018708371e-14

#if LANES == 1
/* 2^k, k as the lowest bits of a number that ROUNDER has been added to. */
static inline vector power_of_two(vector shifted) {
  unsigned long long bits;
  vector power;
  memcpy(&bits, &shifted, sizeof bits);
  bits = (bits + 1023) << 52;
  memcpy(&power, &bits, sizeof power);
  return power;
}
#else
static inline vector power_of_two(vector shifted) { return (vector)(((mask)shifted + 1023) << 52); }
#endif

/* exp x = 2^k exp r, |r| <= log 2 / 2, by the series of exp r up to its 13th power: off by a unit
   in the last place. */
static inline vector exp_of(vector x) {
  const vector most = lanes_of(LARGEST_EXPONENT);
  const vector exponent = smaller_of(larger_of(x, -most), most);
  const vector shifted = exponent * PER_LOG_2 + ROUNDER;
  const vector k = shifted - ROUNDER;
  const vector r = (exponent - k * LOG_2_HIGH) - k * LOG_2_LOW;
  const vector squared = r * r;
  const vector fourth = squared * squared;
  /* Groups of four coefficients 1 / j!. */
  const vector first = 1 + r + squared * (1.0 / 2 + r * (1.0 / 6));
  const vector second = (1.0 / 24 + r * (1.0 / 120)) + squared * (1.0 / 720 + r * (1.0 / 5040));
  const vector third = (1.0 / 40320 + r * (1.0 / 362880)) +
                       squared * (1.0 / 3628800 + r * (1.0 / 39916800));
  const vector last = 1.0 / 479001600 + r * (1.0 / 6227020800.0);
  const vector series = first + fourth * (second + fourth * (third + fourth * last));
  return series * power_of_two(shifted);
}
#endif

static inline vector tanh_of(vector x) { return 1 - 2 / (1 + exp_of(2 * x)); }
