/* How jets meet actuators and the hull, LANES of them at once; docs/theory/interaction.md has the
   formula. No guard, as lanes_vector.h has none. */

/* (1 + tanh x) / 2 */
static inline vector sigmoid_of(vector x) { return 1 / (1 + exp_of(-2 * x)); }

/* Where jets meet actuators. */
typedef struct {
  vector along;          /* the way along the jet, in diameters of its outlet */
  vector squared;        /* of `along` */
  vector aside_squared;  /* the way off the axis, squared */
  vector onset;          /* how far jets have begun, from 0 to 1 */
  vector onset_by_along; /* logarithmic derivative */
} jet_point;

static inline jet_point point_of(real behind, const vector *way, const vector *ahead) {
  jet_point point;
  point.along = -dot_three(way, ahead);
  point.squared = point.along * point.along;
  point.aside_squared = dot_three(way, way) - point.squared;
  point.onset = sigmoid_of(point.along / behind);
  point.onset_by_along = 2 * (1 - point.onset) / behind;
  return point;
}

/* Speed of jets where they meet actuators, over that where they begin: a Gaussian profile that
   widens along them. `by_along` becomes its derivative by the way along them. */
static inline vector rate_of_jet(const water *w, const jet_point *point, vector *by_along) {
  const vector x = point->along;
  const vector per_width = 1 / (point->squared + w->width * w->width);
  const vector aside = point->aside_squared * per_width;
  const vector profile = exp_of(-w->spread * aside);
  const vector q = x * (1 / w->length);
  const vector cube = q * q * q;
  const vector decay = 1 + cube * q;
  const vector rate = profile * point->onset / root_of(root_of(decay));
  /* Logarithmic derivatives of the profile and of the decay. */
  const vector by_profile = 2 * w->spread * x * (1 + aside) * per_width;
  const vector by_decay = cube / (decay * w->length);
  *by_along = rate * (point->onset_by_along + by_profile - by_decay);
  return rate;
}

/* Share of jets that meets the hull, and its derivatives by the direction, in which it is constant
   along it; `begin` is where they begin. */
static inline vector share_on_hull(const water *w, const vector *begin, const vector *ahead,
                                   vector *slope) {
  vector position[3]; /* on the scale of the ellipsoid, which is then a unit sphere */
  vector course[3];
  for (int c = 0; c < 3; c++) {
    position[c] = (begin[c] - w->center[c]) / w->half[c];
    course[c] = -ahead[c] / w->half[c];
  }
  const vector size = root_of(dot_three(course, course) + TINY);
  const vector per_size = 1 / size;
  const vector facing = -dot_three(position, course) * per_size; /* how far ahead the middle is */
  const vector aside_squared = dot_three(position, position) - facing * facing;
  const vector rim = sigmoid_of((1 - aside_squared) / w->grazing);
  const vector side = sigmoid_of(facing / w->grazing);
  const vector by_rim = 2 * facing * (1 - rim);
  const vector d_facing = 2 * rim * side * (by_rim + (1 - side)) / w->grazing;
  for (int c = 0; c < 3; c++) {
    slope[c] = d_facing * (position[c] + facing * course[c] * per_size) * per_size / w->half[c];
  }
  return rim * side;
}
