/* Bounds of the search over Möbius transformations: the inner loops of ../search.py.

   Plain C without a library, for any compiler with vector extensions; built by build_wheel.py, called by ctypes
   (__init__.py). The mathematics and the proofs are in ../bounds.py, of which `images` and `pair_half_width` are the
   same formulas; the equations are those of Le, Chin and Suter (2016).

   Where ../stabbing.py sorts the ends of arcs and sweeps, this file lays arcs over BINS equal stretches of rotations,
   rounded outward to whole stretches, and counts how much each stretch can hold: one bit per stretch and source point
   and carry-save counters if all weights are 1, one 32-bit number per stretch otherwise. Stretches that hold no more
   than the value in hand are dead in every smaller cell too, so the children of a cell look only at the window of
   rotations that is left, in finer stretches: at a finer level of the raster first, then only at the pairs that reach
   into it.

   Angles are in turns (1 is the full circle). No operation may be contracted or reassociated: -ffp-contract=off, no
   -ffast-math; then the result is the same on every machine. Rounding: every computed quantity below is off by less
   than SLACK / |1 - conj(m) c|, and moved outward by that (the analysis is in ../bounds.py).

   Compiled once more with SPHERE, by sphere.c: then source and target lie on the sphere, and where this file says modulus it
   is g = (1 - cos a) / 2, a the polar angle, and where it says disc, a cap; the mathematics is in ../sphere_bounds.py. */

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#ifdef SPHERE
#define NAME(function) sphere_##function
#define NARROW 0.125 /* turns; windows that are not are looked at stretch by stretch */
#else
#define NAME(function) mobius_##function
#endif

#define INTERFACE 13
#define CHILDREN 4 /* of a cell */
#define BINS 512      /* stretches of a window, weights all 1 */
#define WORDS (BINS / 64)
#define HEAVY_BINS 256 /* the same, weights differ */
#define PLANES 16      /* fewer than 2^16 source points */
#define RASTER_GAP 256 /* stretches */
#define FEW_PAIRS 0.25
#define ALIKE 4        /* stretches that a good rotation may be off */
#define LOOKS 32       /* at the rotations of one z */
#define SHARP 0x1p-26  /* turns */
#define STACK 2048     /* open cells of one subtree */
#define CLUSTERS 8     /* windows that the rotations left in one cell are cut into */
#define FULL 0.75      /* a window wider than this is the full circle */

/* The raster: where the match discs lie, in rings of the disc and stretches of angles, for source points that may all
   match the same discs; at several levels, each with twice the angles of the one before. Bit t of row (level, p, q, ring):
   whether a disc touches one of the rings ring .. ring + 2^p - 1 in one of the stretches t .. t + 2^q - 1. So what the
   stretches of a window can match is one row from some bit on, or the union of four. A row goes round the circle once, and
   on for as long as the longest window. */
/* Where rows differ, each source point has its own: the largest weight of a disc that touches a ring and a stretch, as a
   multiple of `step` rounded up, in one byte. */
#define OWN_RINGS 64

#define ANGLES 512     /* of the coarsest level */
#define MOST_LEVELS 5
#define LEAST_RINGS 128
#define SPANS 5
#define FIRST_SPREAD 1 /* a stretch alone touches two */
#define LAST_SPREAD 6
#define MOST_WORDS 32  /* a wider window is looked at on a coarser level */
#define SHARPNESS 0.15 /* length of a stretch, in half-widths of arcs */
#define STEADY 0x1p-6  /* half side of cells that take over the common rotation of the cell around them */

static const double SLACK = 0x1p-42;
static const double TURN = 0x1.921fb54442d18p+2; /* radians */
static const double PER_RADIAN = 0x1.45f306dc9c883p-3; /* turns */

typedef struct { /* one cache line */
    double inner, outer;    /* |b| -+ e, moved outward */
    double turn, widest;    /* arg b in turns; the widest half-angle it is seen under, rounded up */
    double tangent, wide;   /* sqrt(b^2 - e^2), and asin(e / b) in turns, rounded up; tangent < 0: see pair_half_width */
    double b, e;            /* |b| and e */
    /* SPHERE: g of the nearest and farthest point of the cap; its azimuth; the widest half-angle, 1 if it holds a pole; g of
       where it is that, -1 if it holds the upper pole and 2 if the lower; sin and cos of its polar angle, cos of its radius,
       -2 if it holds both poles */
} Pair;

typedef struct {
    int64_t points;         /* N1 */
    const double *mx, *my;  /* source, (N1,) */
    const int64_t *start, *stop; /* row of pairs of each source point, sorted by inner */
    const Pair *discs;      /* (N2,), what the pairs with a target point have in common */
    const uint32_t *disc;   /* of each pair; NULL: rows do not differ, and discs stand in the order of the one row */
    const float *reach;     /* of the pairs: the running maximum of outer along each row, rounded up; NULL with `disc` */
    const uint32_t *weight; /* NULL: all 1 */
    uint64_t *raster;       /* NULL: rows differ, or weights do; then grid is NULL too, and there may be `own` */
    int64_t levels, planes; /* of the raster; of the counters */
    uint8_t *own;           /* NULL: none; (N1, OWN_RINGS, HEAVY_BINS) */
    int64_t step;           /* of its bytes, in weights */
    double density, typical, coarse; /* discs to see at once; half-width of a typical one in turns; smallest half side of cells to use the raster for */
    const int64_t *grid;    /* the one row sorted by ring and sector of b: where each sector begins */
    const int64_t *nearest_ring, *farthest_ring; /* rings of the grid that hold all discs reaching out of and into a ring */
    const double *ring_wide; /* the largest `widest` in a ring of the grid */
    int64_t rings;          /* of the grid, a power of 2 below LEAST_RINGS; each has twice as many sectors */
    double z_max, smallest;
    const volatile int32_t *halt; /* not 0: come back at once, the search is over */
#ifdef SPHERE
    const double *mz;       /* the third coordinate of the source; z_max is not used */
    const double *caps;     /* (N2, 5), in the order of `discs`: centre, cos and sin of the radius */
#endif
} Problem;

typedef struct {
    double x, y, half;      /* cell |Re(z) - x|, |Im(z) - y| <= half */
    double kx, ky;          /* common rotation: theta = window angle - Im(kappa (z - c)) */
    double from, width;     /* window of rotations in turns; width 1: all */
    double bound;           /* no (z, theta) here is worth more */
#ifdef SPHERE
    double face;            /* of the cube, that x, y and half are a cell of axes on */
#endif
} Node;

typedef struct { uint32_t point, pair; } Entry;
typedef uint64_t Quad __attribute__((vector_size(32)));

typedef struct {
    uint32_t bound;
    int clusters;
    uint32_t cluster_bound[CLUSTERS];
    double cluster_from[CLUSTERS], cluster_width[CLUSTERS];
    int first[CLUSTERS], stop[CLUSTERS]; /* the same in stretches; first < 0: across the end */
    double kx, ky;
    int64_t entries, painted;
} Outcome;

static inline const Pair *disc_of(const Problem *p, int64_t pair) { return p->discs + (p->disc ? p->disc[pair] : pair); }

static inline double least(double a, double b) { return a < b ? a : b; }
static inline double most(double a, double b) { return a > b ? a : b; }
static inline double positive(double a) { return a < 0 ? -a : a; }
/* of numbers far below 2^52 */
static inline double whole(double a) { double t = (double)(int64_t)a; return t > a ? t - 1 : t; }

/* An upper bound of asin(s) / (2 pi) for 0 <= s <= 1: the series has positive terms, so that what remains after two of
   them, divided by s^5, is largest at s = 1. */
static inline double arcsine(double s) {
    double q = s * s;
    return PER_RADIAN * s * (1 + q * (1.0 / 6 + q * (0x1.921fb54442d19p+0 - 7.0 / 6))) * (1 + 0x1p-48);
}

/* arg(x + iy) in turns, -1/2 to 1/2, to 2^-49: 17 terms of the alternating series of atan for |t| <= tan(pi / 8) */
static inline double argument(double y, double x) {
    double ax = positive(x), ay = positive(y);
    double low = ax < ay ? ax : ay, high = ax < ay ? ay : ax;
    int upper = low > 0.41421356237309503 * high;
    double over = upper ? low - high : low, under = upper ? low + high : high;
    double t = over / (under > 0 ? under : 1);
    /* four short chains instead of a long one: terms 4 apart */
    double q = t * t, q2 = q * q, q4 = q2 * q2;
    double a = 1.0 / 33, b = 1.0 / 35, c = 1.0 / 29, d = 1.0 / 31;
    a = 1.0 / 25 + q4 * a; b = 1.0 / 27 + q4 * b; c = 1.0 / 21 + q4 * c; d = 1.0 / 23 + q4 * d;
    a = 1.0 / 17 + q4 * a; b = 1.0 / 19 + q4 * b; c = 1.0 / 13 + q4 * c; d = 1.0 / 15 + q4 * d;
    a = 1.0 / 9 + q4 * a; b = 1.0 / 11 + q4 * b; c = 1.0 / 5 + q4 * c; d = 1.0 / 7 + q4 * d;
    a = 1 + q4 * a; b = 1.0 / 3 + q4 * b;
    double s = (a - q * b) + q2 * (c - q * d);
    double angle = t * s * PER_RADIAN + (upper ? 0.125 : 0);
    angle = ax < ay ? 0.25 - angle : angle;
    angle = x < 0 ? 0.5 - angle : angle;
    return y < 0 ? -angle : angle;
}

#ifndef SPHERE
/* ../bounds.py: slopes. D = 1 / (m - c) + conj(m) / (1 - conj(m) c), minus the derivative of log of the image. */
static void slopes(int64_t n, const double *restrict mx, const double *restrict my, double cx, double cy,
                   double *restrict dx, double *restrict dy) {
    for (int64_t j = 0; j < n; j++) {
        double ax = mx[j] - cx, ay = my[j] - cy;
        double fx = 1 - (mx[j] * cx + my[j] * cy), fy = my[j] * cx - mx[j] * cy;
        double a2 = most(ax * ax + ay * ay, 0x1p-200), f2 = most(fx * fx + fy * fy, 0x1p-200);
        dx[j] = ax / a2 + (mx[j] * fx - my[j] * fy) / f2;
        dy[j] = -ay / a2 - (mx[j] * fy + my[j] * fx) / f2;
    }
}

/* One step of Weiszfeld's iteration towards the geometric median of -D: any kappa gives a bound, this one a good one. */
static void common_rotation(int64_t n, const double *restrict dx, const double *restrict dy, double *kx, double *ky) {
    double x[4] = {0}, y[4] = {0}, total[4] = {0};
    int64_t j = 0;
    for (; j + 4 <= n; j += 4)
        for (int i = 0; i < 4; i++) {
            double u = dx[j + i] + *kx, v = dy[j + i] + *ky;
            double w = 1 / (__builtin_sqrt(u * u + v * v) + 0.05);
            x[i] += w * dx[j + i]; y[i] += w * dy[j + i]; total[i] += w;
        }
    for (; j < n; j++) {
        double u = dx[j] + *kx, v = dy[j] + *ky;
        double w = 1 / (__builtin_sqrt(u * u + v * v) + 0.05);
        x[0] += w * dx[j]; y[0] += w * dy[j]; total[0] += w;
    }
    double sum = (total[0] + total[1]) + (total[2] + total[3]);
    if (!(sum > 0)) return;
    *kx = -((x[0] + x[1]) + (x[2] + x[3])) / sum;
    *ky = -((y[0] + y[1]) + (y[2] + y[3])) / sum;
}

/* ../bounds.py: images. Argument alpha +- delta in turns (delta >= 1/2: any), modulus [near, far] of h(m | z). */
static void images(int64_t n, const double *restrict mx, const double *restrict my, double cx, double cy, double half,
                   double kx, double ky, double *restrict alpha, double *restrict delta, double *restrict near,
                   double *restrict far) {
    double r = half * 0x1.6a09e667f3bcep+0; /* sqrt(2) rounded up */
    double common = half * (positive(kx) + positive(ky));
    for (int64_t j = 0; j < n; j++) {
        double x = mx[j], y = my[j], m2 = x * x + y * y;
        double ax = x - cx, ay = y - cy;
        double fx = 1 - (x * cx + y * cy), fy = y * cx - x * cy;
        double a2 = most(ax * ax + ay * ay, 0x1p-200), f2 = most(fx * fx + fy * fy, 0x1p-200);
        double ia = 1 / __builtin_sqrt(a2), jf = 1 / __builtin_sqrt(f2), m = __builtin_sqrt(m2);
        double f = f2 * jf, slack = SLACK * jf, s1 = r * ia, s2 = m * r * jf;
        int pole = (f < 0x1p-16) | (s2 > 1 - 0x1p-10);
        int turns = pole | (s1 > 1 - 0x1p-30);
        double t1 = turns ? 0 : s1, t2 = turns ? 0 : s2;
        double rest = (t1 * t1 * (1 - t2) + t2 * t2 * (1 - t1)) / (2 * (1 - t1) * (1 - t2));
        double i2 = ia * ia, j2 = jf * jf;
        double ux = ax * i2, uy = -ay * i2, vx = (x * fx - y * fy) * j2, vy = -(x * fy + y * fx) * j2;
        double linear = half * (positive(ux + vx + kx) + positive(uy + vy + ky)) + rest;
        double angle = least(linear * PER_RADIAN, arcsine(t1) + arcsine(t2) + common * PER_RADIAN) + slack * PER_RADIAN;
        alpha[j] = argument(ax * fy + ay * fx, ax * fx - ay * fy);
        delta[j] = turns ? 1 : angle;

        double span = 1 / (pole ? 1 : f2 - m2 * r * r);
        double gx = x * r * r - (ax * fx + ay * fy), gy = y * r * r - (ay * fx - ax * fy);
        double middle = __builtin_sqrt(gx * gx + gy * gy) * span;
        double spread = r * most(1 - m2, 0) * span;
        double off = SLACK * (1 + middle + spread) * span;
        double low = middle - spread - off, high = middle + spread + off;
        double growth = half * (positive(ux - vx) + positive(uy - vy)) + rest + slack;
        double h = a2 * ia * jf;
        int flat = (!turns) & (growth < 1);
        low = flat ? most(low, h * (1 - growth) - slack) : low;
        high = flat ? least(high, h * (1 + growth + growth * growth) + slack) : high;
        near[j] = pole ? 0 : most(low, 0);
        far[j] = pole ? 1 : least(most(high, low), 1);
    }
}

static double reach_of(const Node *node) { return node->half; }
#endif

#ifdef SPHERE
/* ../sphere_bounds.py: FACES. The rotation that takes the middle of each face of the cube to the upper pole. */
static const double FACES[6][9] = {{1, 0, 0, 0, 1, 0, 0, 0, 1},  {1, 0, 0, 0, -1, 0, 0, 0, -1}, {0, 0, -1, 0, 1, 0, 1, 0, 0},
                                   {0, 0, 1, 0, 1, 0, -1, 0, 0}, {1, 0, 0, 0, 0, -1, 0, 1, 0},  {1, 0, 0, 0, 0, 1, 0, -1, 0}};

/* ../sphere_bounds.py: axis_radius. No axis of the cell is farther from its middle than this, in radians. */
static double axis_radius(double x, double y, double half) {
    if (!(half > 0)) return 0;
    double sum = positive(x) + positive(y);
    double across = half * __builtin_sqrt(2 + sum * sum), along = 1 + x * x + y * y - half * sum;
    return argument(across, along) * TURN * (1 + 0x1p-40) + 0x1p-50;
}

static double reach_of(const Node *node) { return axis_radius(node->x, node->y, node->half); }

/* ../sphere_bounds.py: frames. */
static void frame_of(const Node *node, double frame[9]) {
    double length = 1 / __builtin_sqrt(1 + node->x * node->x + node->y * node->y);
    double cx = node->x * length, cy = node->y * length, cz = length, over = 1 / (1 + cz);
    double to_axis[9] = {1 - cx * cx * over, -cx * cy * over, -cx, -cx * cy * over, 1 - cy * cy * over, -cy, cx, cy, cz};
    const double *turn = FACES[(int)node->face];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            frame[3 * i + k] = to_axis[3 * i] * turn[k] + to_axis[3 * i + 1] * turn[3 + k] + to_axis[3 * i + 2] * turn[6 + k];
}

/* ../sphere_bounds.py: images. Azimuth alpha +- delta in turns (delta >= 1/2: any), g in [near, far]. */
static void sphere_images(int64_t n, const double *restrict mx, const double *restrict my, const double *restrict mz,
                          const Node *node, double *restrict alpha, double *restrict delta, double *restrict near,
                          double *restrict far) {
    double tilt = axis_radius(node->x, node->y, node->half);
    int any = !(tilt < 1.5);
    tilt = any ? 0 : tilt;
    double q = tilt * tilt, rest = q * q * q * q * q / 3000000;
    double c = 1 - q * (0.5 - q * (1.0 / 24 - q * (1.0 / 720 - q * (1.0 / 40320))));
    double s = tilt * (1 - q * (1.0 / 6 - q * (1.0 / 120 - q * (1.0 / 5040 - q * (1.0 / 362880)))));
    double frame[9];
    frame_of(node, frame);
    for (int64_t j = 0; j < n; j++) {
        double x = mx[j], y = my[j], z = mz[j];
        double vx = frame[0] * x + frame[1] * y + frame[2] * z, vy = frame[3] * x + frame[4] * y + frame[5] * z;
        double vz = frame[6] * x + frame[7] * y + frame[8] * z;
        double sine = __builtin_sqrt(vx * vx + vy * vy);
        double low = vz * c + sine * s, high = vz * c - sine * s; /* cosines of the polar angle less and plus tilt */
        double low_sine = sine * c - vz * s - rest - SLACK, high_sine = sine * c + vz * s - rest - SLACK;
        int top = !(low_sine > 0), bottom = !(high_sine > 0); /* a pole is in reach */
        near[j] = (any | top) ? 0 : most(0.5 * (1 - low - rest) - SLACK, 0);
        far[j] = (any | bottom) ? 1 : least(0.5 * (1 - high + rest) + SLACK, 1);
        double plain = (s + rest + SLACK) / sine;
        double steep = most((positive(low) + rest + SLACK) / low_sine, (positive(high) + rest + SLACK) / high_sine);
        double sure = (top | bottom) ? 1 : 1 / sine;
        double slanted = (top | bottom) ? 1 : tilt * steep * (1 + 0x1p-40) * PER_RADIAN + SLACK * sure;
        double angle = least(plain < 1 ? arcsine(plain) : 1, slanted) + 4 * SLACK * sure;
        alpha[j] = argument(vy, vx);
        delta[j] = (any | top | bottom | !(angle < 0.5)) ? 1 : angle;
    }
}
#endif

/* Twice the angle whose sine's square is q, in turns, rounded up by less than the tolerance and some slack. */
static inline double half_angle(double q, double tolerance) {
    if (!(q < 1)) return 1;
    if (!(q > 0)) return 0;
    double s = __builtin_sqrt(q);
    if (q * q * s < tolerance * TURN) return 2 * arcsine(s); /* off by less than s^5 / 2 */
    return 2 * (argument(s, __builtin_sqrt(1 - q)) + SLACK * PER_RADIAN);
}

#ifdef SPHERE
/* ../sphere_bounds.py: widest_half_angle, in turns. The widest circle is where a great circle touches the cap. */
static inline double pair_half_width(const Pair *pair, double near, double far, double tolerance) {
    double g = near;
    if (pair->tangent >= 0) {
        if (far < pair->tangent) g = far;
        else if (near <= pair->tangent) return pair->widest;
    }
    double sine = 2 * __builtin_sqrt(g * (1 - g));
    double above = (1 - 2 * g) * pair->b + sine * pair->wide - pair->e + 0x1p-48;
    if (!(above > 0)) return 0;
    return half_angle(above / (2 * sine * pair->wide) * (1 + 0x1p-46), tolerance);
}
#else
/* ../bounds.py: widest_half_angle, in turns. The widest circle is that of the tangents' length, if it is in reach. */
static inline double pair_half_width(const Pair *pair, double near, double far, double tolerance) {
    double rho = near, b = pair->b, e = pair->e, rest = 0x1p-48;
    if (pair->tangent >= 0) {
        if (far < pair->tangent) rho = far;
        else if (near <= pair->tangent) return pair->wide;
    } else { /* the disc holds the centre, or nearly so */
        if (near <= -pair->tangent) return 1;
        rest = 0x1p-44 * e;
    }
    double q = ((e - (b - rho)) * (e + (b - rho)) + rest) / (4 * rho * b) * (1 + 0x1p-48);
    return half_angle(q, tolerance);
}
#endif

static inline void paint(uint64_t *word, int low, int high) {
    int first = low >> 6, last = high >> 6;
    uint64_t head = ~(uint64_t)0 << (low & 63), tail = ~(uint64_t)0 >> (63 - (high & 63));
    if (first == last) { word[first] |= head & tail; return; }
    word[first] |= head;
    for (int i = first + 1; i < last; i++) word[i] = ~(uint64_t)0;
    word[last] |= tail;
}

typedef struct {
    uint32_t stretch[HEAVY_BINS], whole; /* the largest weight on each stretch, and on all of them */
    int clean;                           /* nothing is laid on single stretches */
} Row;

static inline void paint_heavy(Row *into, int low, int high, uint32_t weight) {
    uint32_t *row = into->stretch;
    if (weight <= into->whole) return;
    if (low == 0 && high == HEAVY_BINS - 1) { into->whole = weight; return; }
    if (into->clean) for (int i = 0; i < HEAVY_BINS; i++) row[i] = 0;
    into->clean = 0;
    for (int i = low; i <= high; i++) row[i] = row[i] > weight ? row[i] : weight;
}

static inline Quad quad_at(const uint64_t *word) { Quad q; __builtin_memcpy(&q, word, sizeof q); return q; }
static inline int any(Quad q) { return (q[0] | q[1] | q[2] | q[3]) != 0; }

/* One bit of each stretch's count after another, the lowest first. */
typedef struct {
    uint64_t plane[PLANES][MOST_WORDS];
    int words, planes;
} Counter;

static void counter_clear(Counter *c, int words, int planes) {
    c->words = words; c->planes = planes;
    for (int i = 0; i < planes; i++) for (int k = 0; k < words; k++) c->plane[i][k] = 0;
}

typedef struct {
    double *mx, *my, *alpha, *delta, *near, *far, *dx, *dy; /* (N1,) each; SPHERE: dx is the third coordinate */
    uint32_t *active;       /* (N1,) */
    Entry *arena;
    int64_t room;
    Counter counter;
    uint64_t own[8][MOST_WORDS + 4];
} Work;

#define ADD3(carry, sum, a, b, c) do { Quad u_ = (a) ^ (b), v_ = (c); carry = ((a) & (b)) | (u_ & v_); sum = u_ ^ v_; } while (0)

/* Count eight masks in the four words from `at` on. */
static inline void counter_add(Counter *c, int at, const Quad mask[8]) {
    Quad ones = quad_at(c->plane[0] + at), twos = quad_at(c->plane[1] + at), fours = quad_at(c->plane[2] + at);
    Quad a, b, twos_a, twos_b, fours_a, fours_b, carry;
    ADD3(twos_a, ones, ones, mask[0], mask[1]);
    ADD3(twos_b, ones, ones, mask[2], mask[3]);
    ADD3(fours_a, twos, twos, twos_a, twos_b);
    ADD3(a, ones, ones, mask[4], mask[5]);
    ADD3(b, ones, ones, mask[6], mask[7]);
    ADD3(fours_b, twos, twos, a, b);
    ADD3(carry, fours, fours, fours_a, fours_b);
    __builtin_memcpy(c->plane[0] + at, &ones, sizeof ones);
    __builtin_memcpy(c->plane[1] + at, &twos, sizeof twos);
    __builtin_memcpy(c->plane[2] + at, &fours, sizeof fours);
    for (int i = 3; i < PLANES && any(carry); i++) {
        Quad old = quad_at(c->plane[i] + at), sum = old ^ carry;
        __builtin_memcpy(c->plane[i] + at, &sum, sizeof sum);
        carry &= old;
    }
}

/* Which stretches among `among` hold more than `value`. */
static void counter_above(const Counter *c, int64_t value, const uint64_t *among, uint64_t *above) {
    int none = value >= (int64_t)1 << c->planes;
    for (int k = 0; k < c->words; k++) {
        uint64_t more = 0, equal = among[k];
        if (value < 0) { above[k] = equal; continue; }
        for (int i = c->planes - 1; i >= 0; i--) {
            uint64_t bit = c->plane[i][k];
            if (value >> i & 1) equal &= bit;
            else { more |= equal & bit; equal &= ~bit; }
        }
        above[k] = none ? 0 : more;
    }
}

/* The largest count among some stretches, of words first .. last. */
static uint32_t counter_most(const Counter *c, const uint64_t *among, int first, int last) {
    uint64_t left[MOST_WORDS];
    uint32_t count = 0;
    for (int k = first; k <= last; k++) left[k] = among[k];
    for (int i = c->planes - 1; i >= 0; i--) {
        uint64_t some = 0;
        for (int k = first; k <= last; k++) some |= left[k] & c->plane[i][k];
        if (!some) continue;
        count |= (uint32_t)1 << i;
        for (int k = first; k <= last; k++) left[k] &= c->plane[i][k];
    }
    return count;
}

static inline int stretch(double position, int bins) { return position < bins ? (int)position : bins - 1; }

static inline int angles_of(int level) { return ANGLES << level; }
static inline int rings_of(int level) { int n = angles_of(level) / 8; return n < LEAST_RINGS ? LEAST_RINGS : n; }
static inline int row_words(int level) {
    int n = angles_of(level) / 64;
    return n + (n < MOST_WORDS ? n : MOST_WORDS) + 1;
}
static inline size_t level_words(int level) {
    return (size_t)SPANS * (LAST_SPREAD - FIRST_SPREAD + 1) * rings_of(level) * row_words(level);
}

static inline const uint64_t *level_of(const uint64_t *raster, int level) {
    for (int i = 0; i < level; i++) raster += level_words(i);
    return raster;
}

static inline size_t row_of(int level, int span, int spread, int ring) {
    return (((size_t)span * (LAST_SPREAD - FIRST_SPREAD + 1) + spread - FIRST_SPREAD) * rings_of(level) + ring) * row_words(level);
}

EXPORT int64_t NAME(raster_bytes)(int64_t levels) {
    size_t words = 0;
    for (int i = 0; i < levels; i++) words += level_words(i);
    return (int64_t)(words * sizeof(uint64_t));
}

/* Draw the discs of the one row of pairs; only some of them if halted. */
EXPORT void NAME(raster)(const Problem *p) {
    for (int level = 0; level < p->levels; level++) {
        uint64_t *raster = (uint64_t *)level_of(p->raster, level);
        int angles = angles_of(level), rings = rings_of(level), words = angles / 64, length = row_words(level);
        uint64_t plain[(ANGLES << (MOST_LEVELS - 1)) / 64 + 1];
        for (int ring = 0; ring < rings; ring++) {
            if (*p->halt) return;
            double near = ring * (1.0 / rings), far = (ring + 1) * (1.0 / rings);
            uint64_t *row = raster + row_of(level, 0, FIRST_SPREAD, ring);
            for (int i = 0; i < words; i++) plain[i] = 0;
            /* those of the rings of the grid that can reach here */
            int64_t first = p->grid[p->nearest_ring[ring * p->rings / rings] * 2 * p->rings];
            int64_t last = p->grid[(p->farthest_ring[ring * p->rings / rings] + 1) * 2 * p->rings];
            for (int64_t k = first; k < last; k++) {
                const Pair *pair = p->discs + k;
                if (pair->outer < near || pair->inner > far) continue;
                double half_width = pair_half_width(pair, near, far, 0x1p-14) + SLACK;
                if (2 * half_width + 2.0 / angles >= 1) { paint(plain, 0, angles - 1); continue; }
                double begin = pair->turn - half_width;
                begin -= whole(begin);
                int low = (int)(begin * angles), high = (int)((begin + 2 * half_width) * angles);
                if (low > angles - 1) low = angles - 1;
                paint(plain, low, high < angles ? high : angles - 1);
                if (high >= angles) paint(plain, 0, high - angles);
            }
            plain[words] = plain[0];
            for (int i = 0; i < words; i++) row[i] = plain[i] | plain[i] >> 1 | plain[i + 1] << 63; /* spread by one */
            for (int i = words; i < length; i++) row[i] = row[i - words];
            /* widen by doubling: D_(q+1)(t) = D_q(t) | D_q(t + 2^q) */
            for (int q = FIRST_SPREAD; q < LAST_SPREAD; q++) {
                uint64_t *next = raster + row_of(level, 0, q + 1, ring);
                int shift = 1 << q;
                for (int i = 0; i < words; i++) next[i] = row[i] | row[i] >> shift | row[i + 1] << (64 - shift);
                for (int i = words; i < length; i++) next[i] = next[i - words];
                row = next;
            }
        }
        for (int span = 1; span < SPANS; span++)
            for (int q = FIRST_SPREAD; q <= LAST_SPREAD; q++)
                for (int ring = 0; ring < rings; ring++) {
                    int other = ring + (1 << (span - 1));
                    uint64_t *row = raster + row_of(level, span, q, ring);
                    const uint64_t *a = raster + row_of(level, span - 1, q, ring);
                    const uint64_t *b = raster + row_of(level, span - 1, q, other < rings ? other : ring);
                    for (int i = 0; i < length; i++) row[i] = a[i] | b[i];
                }
    }
}

/* Four words of the union of two rows, from bit `bit` of the first on. */
static inline Quad rows_from(const uint64_t *a, const uint64_t *b, int bit) {
    Quad low = quad_at(a) | quad_at(b), high = quad_at(a + 1) | quad_at(b + 1);
    return low >> bit | high << 1 << (63 - bit);
}

/* Where in the raster to look for one source point: rows a and b from one bit on, c and d from another. */
typedef struct { const uint64_t *a, *b, *c, *d; int bit, other; } Spot;

/* The stretches of a window from `from` on that may bring an image at alpha +- delta, [near, far] onto a disc. `own`: room
   for a row, in case that the image takes more than four of the raster's. */
static inline Spot spot(const uint64_t *raster, int level, int words, double from, double near, double far, double alpha,
                        double delta, uint64_t *own) {
    int angles = angles_of(level), rings = rings_of(level);
    int inside = (int)(near * rings), outside = (int)(far * rings);
    if (inside > rings - 1) inside = rings - 1;
    if (outside > rings - 1) outside = rings - 1;
    int first = 0, count = angles;
    if (delta < 0.25) {
        first = (int)(int64_t)whole((alpha - delta + from) * angles);
        count = (int)(int64_t)whole((alpha + delta + from) * angles) + 2 - first;
    }
    int spread = 31 - __builtin_clz((unsigned)count), span = 31 - __builtin_clz((unsigned)(outside - inside + 1));
    if (spread <= LAST_SPREAD && span < SPANS) {
        int second = (first + count - (1 << spread)) & (angles - 1);
        first &= angles - 1;
        const uint64_t *a = raster + row_of(level, span, spread, inside);
        const uint64_t *b = raster + row_of(level, span, spread, outside - (1 << span) + 1);
        return (Spot){a + first / 64, b + first / 64, a + second / 64, b + second / 64, first & 63, second & 63};
    }
    for (int i = 0; i <= words; i++) own[i] = 0;
    if (spread > LAST_SPREAD) spread = LAST_SPREAD;
    if (span > SPANS - 1) span = SPANS - 1;
    for (int ring = inside; ring <= outside; ring += 1 << span) {
        if (ring > outside - (1 << span) + 1) ring = outside - (1 << span) + 1;
        for (int at = 0; at < count; at += 1 << spread) {
            if (at > count - (1 << spread)) at = count - (1 << spread);
            int bit = (first + at) & (angles - 1);
            const uint64_t *row = raster + row_of(level, span, spread, ring) + bit / 64;
            for (int i = 0; i < words; i += 4) {
                Quad q = quad_at(own + i) | rows_from(row + i, row + i, bit & 63);
                __builtin_memcpy(own + i, &q, sizeof q);
            }
        }
    }
    return (Spot){own, own, own, own, 0, 0};
}

/* Lay the arc over the window; returns whether it reaches into it. `bits` or `row` is painted. */
static inline int lay(double centre, double half_width, double from, double width, int bins, double scale,
                      uint64_t *bits, Row *row, uint32_t weight) {
    int low[2], high[2], pieces = 0;
    if (2 * half_width >= 1) { low[0] = 0; high[0] = bins - 1; pieces = 1; }
    else {
        double begin = centre - half_width - from;
        begin -= whole(begin);
        double end = begin + 2 * half_width;
        if (begin <= width) {
            low[0] = stretch(begin * scale, bins);
            high[0] = stretch(end * scale, bins);
            pieces = 1;
        }
        if (end >= 1) {
            low[pieces] = 0;
            high[pieces++] = stretch((end - 1) * scale, bins);
        }
    }
    for (int i = 0; i < pieces; i++) {
        if (bits) paint(bits, low[i], high[i]);
        else paint_heavy(row, low[i], high[i], weight);
    }
    return pieces;
}

/* Cut the live stretches, each `stretch` turns long, into windows: more than `gap` dead ones separate two. `round`: how many
   make the full circle, or 0. */
static void cluster(const uint64_t *live, int words, double from, double stretch, int round, int gap, Outcome *out) {
    int n = 0, start = -1, stop = -1;
    for (int w = 0; w <= words; w++) {
        uint64_t x = w < words ? live[w] : 1; /* the last is a sentinel that closes the last window */
        while (x) {
            int bit = __builtin_ctzll(x), length = 1;
            if (w < words) {
                uint64_t rest = ~(x >> bit);
                length = rest ? __builtin_ctzll(rest) : 64;
                if (length > 64 - bit) length = 64 - bit;
            }
            x = bit + length < 64 ? x >> (bit + length) << (bit + length) : 0;
            int at = 64 * w + bit;
            if (start >= 0 && w < words && at - stop <= gap) { stop = at + length; continue; }
            if (start >= 0) {
                if (n == CLUSTERS) out->stop[n - 1] = stop;
                else { out->first[n] = start; out->stop[n++] = stop; }
            }
            start = at; stop = at + length;
            if (w == words) break;
        }
    }
    if (round && n > 1 && out->first[0] + round - out->stop[n - 1] <= gap) out->first[0] = out->first[--n] - round;
    for (int c = 0; c < n; c++) {
        out->cluster_from[c] = from + out->first[c] * stretch;
        out->cluster_width[c] = (out->stop[c] - out->first[c]) * stretch;
    }
    out->clusters = n;
}

/* What to bound: a cell and a window, over `entries` pairs if not NULL (those of a cell and window around these), over
   the raster, or over all pairs. Only stretches worth more than `value` count, and with `share` > 0 only those worth that
   share of the best; more than `gap` others separate two windows.
   `children`: where the pairs that reach into the window go, or NULL. */
typedef struct {
    const Node *node;
    double value;
    int raster;
    const Entry *parents;
    int64_t entries;
    Entry *children;
    int64_t room;
    int gap;
    double share;
} Query;

static inline double least_worth(const Query *q, uint32_t bound) {
    return q->share > 0 ? most(q->value, least(bound * q->share, bound - 1.0)) : q->value;
}

typedef struct {
    const Problem *p;
    const Query *q;
    Outcome *out;
    double from, width, middle, reach, scale; /* the window */
    double fine;            /* a small part of a stretch */
    int bins;
    uint32_t total[HEAVY_BINS], whole;
    Row row;
} Laying;

/* Lay the arcs of one source point and some of its pairs. */
static inline int lay_pairs(Laying *l, uint32_t j, const Entry *list, int64_t low, int64_t high, double near, double far,
                            double alpha, double delta, uint64_t *bits) {
    const Problem *p = l->p;
    Outcome *out = l->out;
    int touched = 0;
    for (int64_t k = low; k < high; k++) {
        int64_t number = list ? list[k].pair : k;
        const Pair *pair = disc_of(p, number);
        if (pair->outer < near || pair->inner > far) continue;
        if (l->width < 1) { /* too far from the window, however wide the disc looks */
            double apart = pair->turn - alpha - l->middle;
            apart = positive(apart - whole(apart + 0.5));
            if (apart > delta + pair->widest + l->reach) continue;
        }
        double half_width = delta + pair_half_width(pair, near, far, delta / 32 + l->fine);
        if (!lay(pair->turn - alpha, half_width, l->from, l->width, l->bins, l->scale, bits, &l->row,
                 p->weight ? p->weight[number] : 1)) continue;
        touched = 1;
        out->painted++;
        if (l->q->children) {
            if (out->entries < l->q->room) l->q->children[out->entries] = (Entry){j, (uint32_t)number};
            out->entries++;
        }
    }
    return touched;
}

/* The same for all pairs of a source point that can reach the ring [near, far] and the window. */
static inline int lay_row(Laying *l, uint32_t j, double near, double far, double alpha, double delta, uint64_t *bits) {
    const Problem *p = l->p;
    if (!p->grid) { /* a row of its own, sorted by inner */
        int64_t low = p->start[j], high = p->stop[j], a = low, b = high;
        while (a < b) { int64_t mid = (a + b) / 2; if (p->reach[mid] < near) a = mid + 1; else b = mid; }
        low = a; b = high;
        while (a < b) { int64_t mid = (a + b) / 2; if (disc_of(p, mid)->inner <= far) a = mid + 1; else b = mid; }
        return lay_pairs(l, j, 0, low, a, near, far, alpha, delta, bits);
    }
    int rings = (int)p->rings, all = 2 * rings, inside = (int)(near * rings), outside = (int)(far * rings), touched = 0;
    inside = (int)p->nearest_ring[inside < rings ? inside : rings - 1];
    outside = (int)p->farthest_ring[outside < rings ? outside : rings - 1];
    if (l->width >= 1 || delta > 0.25) {
        if (inside > outside) return 0;
        return lay_pairs(l, j, 0, p->grid[inside * all], p->grid[(outside + 1) * all], near, far, alpha,
                         delta, bits);
    }
    for (int ring = inside; ring <= outside; ring++) {
        double margin = delta + p->ring_wide[ring] + 0x1p-40, begin = alpha + l->from - margin;
        double end = begin + l->width + 2 * margin;
        const int64_t *sectors = p->grid + ring * all;
        if (end - begin > 1 - 2.0 / all) {
            touched |= lay_pairs(l, j, 0, sectors[0], sectors[all], near, far, alpha, delta, bits);
            continue;
        }
        int first = (int)whole(begin * all), count = (int)whole(end * all) - first + 1;
        first &= all - 1;
        int stop = first + count;
        touched |= lay_pairs(l, j, 0, sectors[first], sectors[stop < all ? stop : all], near, far, alpha,
                             delta, bits);
        if (stop > all)
            touched |= lay_pairs(l, j, 0, sectors[0], sectors[stop - all], near, far, alpha, delta, bits);
    }
    return touched;
}

/* What the counted stretches of a window come to. */
static void weigh(const Counter *count, const uint64_t *window, const Query *q, double from, double stretch, int round,
                  Outcome *out) {
    uint64_t above[MOST_WORDS];
    out->bound = counter_most(count, window, 0, count->words - 1);
    if ((double)out->bound <= q->value) return;
    double value = least_worth(q, out->bound);
    counter_above(count, value < 0 ? -1 : (int64_t)value, window, above);
    cluster(above, count->words, from, stretch, round, q->gap, out);
    for (int c = 0; c < out->clusters; c++) {
        uint64_t among[MOST_WORDS];
        int first = out->first[c], stop = out->stop[c], low = first > 0 ? first >> 6 : 0, high = (stop - 1) >> 6;
        if (first < 0) { low = 0; high = count->words - 1; }
        for (int k = low; k <= high; k++) among[k] = 0;
        if (first < 0) { paint(among, first + round, round - 1); first = 0; }
        paint(among, first, stop - 1);
        for (int k = low; k <= high; k++) among[k] &= above[k];
        out->cluster_bound[c] = counter_most(count, among, low, high);
    }
}

/* Bound Q over a cell and a window by the raster, at the level that suits how far the images spread. */
static void sum_raster(const Problem *p, Work *w, const Query *q, int64_t n, double from, double width, Outcome *out) {
    double spread = 0;
    for (int64_t i = 0; i < n; i++) spread += least(w->delta[i], 0x1p-4);
    spread = SHARPNESS * (p->typical + spread / (double)n);
    int level = 0;
    while (level + 1 < p->levels && spread * angles_of(level) < 1) level++;
    while (level > 0 && width * angles_of(level) > 64 * MOST_WORDS) level--;
    while (level + 1 < p->levels && width * angles_of(level + 1) < 250) level++; /* no more words than that */
    int angles = angles_of(level), bins = width < 1 ? (int)(width * angles) + 1 : angles;
    int words = (bins + 255) / 256 * 4;
    if (words > MOST_WORDS) words = MOST_WORDS;
    static const uint64_t nothing[MOST_WORDS + 1];
    const uint64_t *raster = level_of(p->raster, level);
    Counter *count = &w->counter;
    counter_clear(count, words, (int)p->planes);
    for (int64_t j = 0; j < n; j += 8) {
        Spot at[8];
        for (int i = 0; i < 8; i++)
            if (j + i < n)
                at[i] = spot(raster, level, words, from, w->near[j + i], w->far[j + i], w->alpha[j + i], w->delta[j + i], w->own[i]);
            else at[i] = (Spot){nothing, nothing, nothing, nothing, 0, 0};
        for (int k = 0; k < words; k += 4) {
            Quad mask[8];
            for (int i = 0; i < 8; i++)
                mask[i] = rows_from(at[i].a + k, at[i].b + k, at[i].bit) | rows_from(at[i].c + k, at[i].d + k, at[i].other);
            counter_add(count, k, mask);
        }
    }
    uint64_t window[MOST_WORDS] = {0};
    paint(window, 0, bins < 64 * words ? bins - 1 : 64 * words - 1);
    weigh(count, window, q, from, 1.0 / angles, width < 1 ? 0 : angles, out);
}

/* What the weights of the stretches of a window come to. */
static void weigh_heavy(const uint32_t *total, const uint64_t *window, const Query *q, double from, double stretch, int round,
                        Outcome *out) {
    uint32_t best = 0;
    for (int k = 0; k < HEAVY_BINS; k++)
        if (window[k >> 6] >> (k & 63) & 1 && total[k] > best) best = total[k];
    out->bound = best;
    if ((double)best <= q->value) return;
    uint64_t live[HEAVY_BINS / 64] = {0};
    double value = least_worth(q, best);
    for (int k = 0; k < HEAVY_BINS; k++) live[k >> 6] |= (uint64_t)((double)total[k] > value) << (k & 63);
    for (int k = 0; k < HEAVY_BINS / 64; k++) live[k] &= window[k];
    cluster(live, HEAVY_BINS / 64, from, stretch, round, q->gap, out);
    for (int c = 0; c < out->clusters; c++) {
        out->cluster_bound[c] = 0;
        for (int k = out->first[c]; k < out->stop[c]; k++) {
            int at = k < 0 ? k + HEAVY_BINS : k;
            if (live[at >> 6] >> (at & 63) & 1 && total[at] > out->cluster_bound[c]) out->cluster_bound[c] = total[at];
        }
    }
}

/* Draw each source point's own discs; only of some if halted. */
EXPORT void NAME(own_raster)(const Problem *p) {
    for (int64_t j = 0; j < p->points && !*p->halt; j++) {
        uint8_t *raster = p->own + j * OWN_RINGS * HEAVY_BINS;
        for (int i = 0; i < OWN_RINGS * HEAVY_BINS; i++) raster[i] = 0;
        for (int64_t k = p->start[j]; k < p->stop[j]; k++) {
            const Pair *pair = disc_of(p, k);
            int64_t weight = p->weight ? p->weight[k] : 1;
            uint8_t level = (uint8_t)((weight + p->step - 1) / p->step);
            int first = (int)(most(pair->inner, 0) * OWN_RINGS), last = (int)(least(pair->outer, 1) * OWN_RINGS);
            /* an end on the edge of two rings touches both */
            if (first > 0 && first >= most(pair->inner, 0) * OWN_RINGS) first--;
            if (first > OWN_RINGS - 1) first = OWN_RINGS - 1;
            if (last > OWN_RINGS - 1) last = OWN_RINGS - 1;
            for (int ring = first; ring <= last; ring++) {
                uint8_t *row = raster + ring * HEAVY_BINS;
                double near = ring * (1.0 / OWN_RINGS), far = (ring + 1) * (1.0 / OWN_RINGS);
                double half_width = pair_half_width(pair, near, far, 0x1p-12) + SLACK, begin = pair->turn - half_width;
                int low = (int)whole(begin * HEAVY_BINS), high = (int)whole((begin + 2 * half_width) * HEAVY_BINS);
                if (high - low >= HEAVY_BINS) { low = 0; high = HEAVY_BINS - 1; }
                for (int i = low; i <= high; i++) {
                    uint8_t *at = row + (i & (HEAVY_BINS - 1));
                    if (*at < level) *at = level;
                }
            }
        }
    }
}

/* Bound Q over a cell and a window by the source points' own rasters. */
static void sum_own_raster(const Problem *p, Work *w, const Query *q, int64_t n, double from, double width, Outcome *out) {
    uint32_t total[HEAVY_BINS] = {0};
    uint16_t some[HEAVY_BINS] = {0};
    for (int64_t j = 0; j < n; j++) {
        int inside = (int)(w->near[j] * OWN_RINGS), outside = (int)(w->far[j] * OWN_RINGS);
        if (inside > OWN_RINGS - 1) inside = OWN_RINGS - 1;
        if (outside > OWN_RINGS - 1) outside = OWN_RINGS - 1;
        const uint8_t *row = p->own + (j * OWN_RINGS + inside) * HEAVY_BINS;
        uint8_t round[2][2 * HEAVY_BINS], *a = round[0], *b = round[1]; /* twice around the circle */
        for (int i = 0; i < HEAVY_BINS; i++) a[i] = row[i];
        for (int ring = inside + 1; ring <= outside; ring++) {
            row += HEAVY_BINS;
            for (int i = 0; i < HEAVY_BINS; i++) a[i] = a[i] > row[i] ? a[i] : row[i];
        }
        int first = 0, count = HEAVY_BINS;
        if (w->delta[j] < 0.25) {
            first = (int)whole((w->alpha[j] - w->delta[j]) * HEAVY_BINS);
            count = (int)whole((w->alpha[j] + w->delta[j]) * HEAVY_BINS) + 2 - first;
        }
        if (count >= HEAVY_BINS) {
            uint8_t best = 0;
            for (int i = 0; i < HEAVY_BINS; i++) best = a[i] > best ? a[i] : best;
            for (int i = 0; i < HEAVY_BINS; i++) some[i] += best;
        } else {
            for (int i = 0; i < HEAVY_BINS; i++) a[HEAVY_BINS + i] = a[i];
            int reach = 1; /* a[t] holds the largest of `reach` stretches from t on */
            for (; 2 * reach <= count; reach *= 2) {
                for (int i = 0; i < HEAVY_BINS; i++) b[i] = a[i] > a[i + reach] ? a[i] : a[i + reach];
                for (int i = 0; i < HEAVY_BINS; i++) b[HEAVY_BINS + i] = b[i];
                uint8_t *other = a; a = b; b = other;
            }
            const uint8_t *low = a + (first & (HEAVY_BINS - 1)), *high = a + ((first + count - reach) & (HEAVY_BINS - 1));
            for (int i = 0; i < HEAVY_BINS; i++) some[i] += low[i] > high[i] ? low[i] : high[i];
        }
        if (j % 256 == 255 || j == n - 1)
            for (int i = 0; i < HEAVY_BINS; i++) { total[i] += some[i]; some[i] = 0; }
    }
    for (int i = 0; i < HEAVY_BINS; i++) total[i] *= (uint32_t)p->step;
    uint64_t window[HEAVY_BINS / 64] = {0};
    if (width < 1) {
        int low = (int)whole(from * HEAVY_BINS), high = (int)whole((from + width) * HEAVY_BINS);
        for (int i = low; i <= high; i++) window[i >> 6 & (HEAVY_BINS / 64 - 1)] |= (uint64_t)1 << (i & 63);
    } else for (int k = 0; k < HEAVY_BINS / 64; k++) window[k] = ~(uint64_t)0;
    weigh_heavy(total, window, q, 0, 1.0 / HEAVY_BINS, HEAVY_BINS, out);
}

static void sum_pairs(const Problem *p, Work *w, const Query *q, int64_t n, double from, double width, Outcome *out) {
    Laying l;
    l.p = p; l.q = q; l.out = out;
    l.from = from; l.width = width;
    l.bins = p->weight ? HEAVY_BINS : BINS;
    l.scale = l.bins / width;
    l.fine = width / l.bins / 32;
    l.middle = from + width / 2; l.reach = width / 2 + 0x1p-40;
    l.whole = 0;
    Quad mask[2][8];
    int waiting = 0;
    if (p->weight) for (int k = 0; k < HEAVY_BINS; k++) l.total[k] = 0;
    else counter_clear(&w->counter, WORDS, (int)p->planes);
    int64_t cursor = 0;
    for (int64_t i = 0; i < n; i++) {
        if (*p->halt) break; /* whoever asked throws the outcome away */
        double near = w->near[i], far = w->far[i], alpha = w->alpha[i], delta = w->delta[i];
        uint64_t bits[WORDS] = {0};
        uint32_t j = q->parents ? w->active[i] : (uint32_t)i;
        l.row.whole = 0; l.row.clean = 1;
        int touched;
        if (q->parents) {
            int64_t low = cursor;
            while (cursor < q->entries && q->parents[cursor].point == j) cursor++;
            touched = lay_pairs(&l, j, q->parents, low, cursor, near, far, alpha, delta, p->weight ? 0 : bits);
        } else touched = lay_row(&l, j, near, far, alpha, delta, p->weight ? 0 : bits);
        if (!touched) continue;
        if (p->weight) {
            uint32_t all = l.row.whole;
            l.whole += all;
            if (!l.row.clean)
                for (int k = 0; k < HEAVY_BINS; k++)
                    l.total[k] += l.row.stretch[k] > all ? l.row.stretch[k] - all : 0;
        } else {
            for (int k = 0; k < WORDS / 4; k++) mask[k][waiting] = quad_at(bits + 4 * k);
            if (++waiting == 8) { waiting = 0; for (int k = 0; k < WORDS / 4; k++) counter_add(&w->counter, 4 * k, mask[k]); }
        }
    }
    if (q->children && out->entries > q->room) out->entries = -1; /* too many to keep */

    if (p->weight) {
        uint64_t all[HEAVY_BINS / 64];
        for (int k = 0; k < HEAVY_BINS; k++) l.total[k] += l.whole;
        for (int k = 0; k < HEAVY_BINS / 64; k++) all[k] = ~(uint64_t)0;
        weigh_heavy(l.total, all, q, from, width / HEAVY_BINS, width < 1 ? 0 : HEAVY_BINS, out);
        return;
    }
    if (waiting) {
        Quad zero = {0};
        for (; waiting < 8; waiting++) for (int k = 0; k < WORDS / 4; k++) mask[k][waiting] = zero;
        for (int k = 0; k < WORDS / 4; k++) counter_add(&w->counter, 4 * k, mask[k]);
    }
    uint64_t window[WORDS];
    for (int k = 0; k < WORDS; k++) window[k] = ~(uint64_t)0;
    weigh(&w->counter, window, q, from, width / BINS, width < 1 ? 0 : BINS, out);
}

#ifdef SPHERE
/* cos and sin of an angle in turns, to 2^-50: series for at most an eighth of a turn. */
static void direction(double turns, double *cosine, double *sine) {
    double quarters = whole(4 * turns + 0.5), x = (turns - quarters * 0.25) * TURN, q = x * x;
    double c = 1 - q / 2 * (1 - q / 12 * (1 - q / 30 * (1 - q / 56 * (1 - q / 90 * (1 - q / 132 * (1 - q / 182))))));
    double s = x * (1 - q / 6 * (1 - q / 20 * (1 - q / 42 * (1 - q / 72 * (1 - q / 110 * (1 - q / 156 * (1 - q / 210)))))));
    int turn = (int)((int64_t)quarters & 3);
    *cosine = turn == 0 ? c : turn == 1 ? -s : turn == 2 ? -c : s;
    *sine = turn == 0 ? s : turn == 1 ? c : turn == 2 ? -s : -c;
}

/* ../sphere_bounds.py: whole_cells. Whether Q exceeds `value` nowhere in a cell and a narrow window, by the pairs of a list
   that can be matched anywhere in both; these are few, and no arc is laid. */
static int surely_dead(const Problem *p, const Query *q, double from, double width) {
    const Node *node = q->node;
    double cosine, sine, frame[9], turned[9];
    direction(from + width / 2, &cosine, &sine);
    frame_of(node, frame);
    for (int k = 0; k < 3; k++) {
        turned[k] = cosine * frame[k] - sine * frame[3 + k];
        turned[3 + k] = sine * frame[k] + cosine * frame[3 + k];
        turned[6 + k] = frame[6 + k];
    }
    double tilt = axis_radius(node->x, node->y, node->half), spin = width * (TURN / 2) * (1 + 0x1p-40);
    int64_t total = 0, last = -1;
    for (int64_t i = 0; i < q->entries; i++) /* lists are sorted by weight */
        if (q->parents[i].point != last) { total += p->weight[q->parents[i].pair]; last = q->parents[i].point; }
    for (int64_t i = 0; i < q->entries && (double)total > q->value;) {
        uint32_t j = q->parents[i].point;
        double x = p->mx[j], y = p->my[j], z = p->mz[j];
        double vx = turned[0] * x + turned[1] * y + turned[2] * z, vy = turned[3] * x + turned[4] * y + turned[5] * z;
        double vz = turned[6] * x + turned[7] * y + turned[8] * z;
        double d = tilt + spin * (__builtin_sqrt(vx * vx + vy * vy) + 0x1p-40);
        uint32_t heaviest = p->weight[q->parents[i].pair], found = 0;
        if (!(d < 1)) { while (i < q->entries && q->parents[i].point == j) i++; continue; }
        double e = d * d, c = 1 - e * (0.5 - e * (1.0 / 24 - e / 720)); /* below cos d */
        double s = d * (1 - e * (1.0 / 6 - e * (1.0 / 120 - e * (1.0 / 5040 - e / 362880)))); /* above sin d */
        for (; i < q->entries && q->parents[i].point == j; i++) {
            uint32_t pair = q->parents[i].pair;
            const double *cap = p->caps + 5 * (p->disc ? p->disc[pair] : pair);
            double dot = vx * cap[0] + vy * cap[1] + vz * cap[2];
            if (cap[3] < -0.5 || dot + SLACK >= cap[3] * (cap[3] > 0 ? c : 1) - cap[4] * s) { found = p->weight[pair]; break; }
        }
        while (i < q->entries && q->parents[i].point == j) i++;
        total -= heaviest - found;
    }
    return !((double)total > q->value);
}

/* Put the pairs of each source point in order of weight, the heaviest first. */
static void by_weight(const Problem *p, Entry *list, int64_t n) {
    for (int64_t i = 1; i < n; i++) {
        Entry key = list[i];
        int64_t k = i;
        while (k > 0 && list[k - 1].point == key.point && p->weight[list[k - 1].pair] < p->weight[key.pair]) { list[k] = list[k - 1]; k--; }
        list[k] = key;
    }
}
#endif

/* Bound Q over a cell and a window, which is moved and widened from the parent's kappa to ours. */
static void evaluate(const Problem *p, Work *w, const Query *q, Outcome *out) {
    const Node *node = q->node;
    int64_t n = 0;
    const double *mx = p->mx, *my = p->my;
#ifdef SPHERE
    if (q->parents && p->weight && node->width < NARROW && surely_dead(p, q, node->from, node->width)) {
        out->kx = out->ky = 0;
        out->bound = 0; out->entries = 0; out->painted = 0; out->clusters = 0;
        return;
    }
#endif
    if (q->parents) {
        for (int64_t i = 0; i < q->entries; i++)
            if (n == 0 || w->active[n - 1] != q->parents[i].point) {
                uint32_t j = q->parents[i].point;
                w->mx[n] = p->mx[j]; w->my[n] = p->my[j];
#ifdef SPHERE
                w->dx[n] = p->mz[j];
#endif
                w->active[n++] = j;
            }
        mx = w->mx; my = w->my;
    } else n = p->points;

    double from = node->from, width = node->width;
#ifdef SPHERE
    sphere_images(n, mx, my, q->parents ? w->dx : p->mz, node, w->alpha, w->delta, w->near, w->far);
    out->kx = out->ky = 0;
#else
    double kx = node->kx, ky = node->ky;
    if (node->half > STEADY) {
        slopes(n, mx, my, node->x, node->y, w->dx, w->dy);
        common_rotation(n, w->dx, w->dy, &kx, &ky);
        common_rotation(n, w->dx, w->dy, &kx, &ky);
    }
    out->kx = kx; out->ky = ky;
    images(n, mx, my, node->x, node->y, node->half, kx, ky, w->alpha, w->delta, w->near, w->far);

    if (width < 1) {
        double shift = node->half * (positive(kx - node->kx) + positive(ky - node->ky)) * PER_RADIAN + 0x1p-40;
        from -= shift; width += 2 * shift;
        if (width > FULL) { from = 0; width = 1; }
    }
#endif
    out->entries = 0; out->painted = 0; out->clusters = 0;
    if (q->raster && p->raster) sum_raster(p, w, q, n, from, width, out);
    else if (q->raster) sum_own_raster(p, w, q, n, from, width, out);
    else sum_pairs(p, w, q, n, from, width, out);
#ifdef SPHERE
    if (p->weight && q->children && !q->parents && out->entries > 0) by_weight(p, q->children, out->entries);
#endif
}

static int64_t doubles_of(int64_t points) { return 8 * points; }

/* Bytes of working memory that each thread must bring. */
EXPORT int64_t NAME(work_bytes)(int64_t points, int64_t arena) {
    return doubles_of(points) * 8 + points * 4 + 64 + arena * (int64_t)sizeof(Entry);
}

static Work work_in(void *memory, int64_t points, int64_t arena) {
    Work w;
    double *d = memory;
    w.mx = d; w.my = d + points; w.alpha = d + 2 * points; w.delta = d + 3 * points;
    w.near = d + 4 * points; w.far = d + 5 * points; w.dx = d + 6 * points; w.dy = d + 7 * points;
    w.arena = (Entry *)(d + doubles_of(points));
    w.room = arena;
    w.active = (uint32_t *)(w.arena + arena);
    return w;
}

#ifndef SPHERE
EXPORT int32_t mobius_interface(void) { return INTERFACE; }

/* Whether this machine runs the library that is built for x86-64-v3: AVX2, FMA, BMI, and a system that saves ymm. */
EXPORT int32_t mobius_runs_v3(void) {
#if defined(__x86_64__)
    uint32_t a = 1, b, c = 0, d, low, high;
    __asm__ volatile("cpuid" : "+a"(a), "=b"(b), "+c"(c), "=d"(d));
    uint32_t wanted = 1u << 12 | 1u << 22 | 1u << 23 | 1u << 27 | 1u << 28 | 1u << 29; /* FMA MOVBE POPCNT OSXSAVE AVX F16C */
    if ((c & wanted) != wanted) return 0;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    if ((low & 6) != 6) return 0;
    a = 7; c = 0;
    __asm__ volatile("cpuid" : "+a"(a), "=b"(b), "+c"(c), "=d"(d));
    wanted = 1u << 3 | 1u << 5 | 1u << 8; /* BMI1 AVX2 BMI2 */
    if ((b & wanted) != wanted) return 0;
    a = 0x80000001; c = 0;
    __asm__ volatile("cpuid" : "+a"(a), "=b"(b), "+c"(c), "=d"(d));
    return (c >> 5 & 1); /* LZCNT */
#else
    return 0;
#endif
}
#endif

/* For the tests: what `images` makes of one cell, with the common rotation given. */
#ifdef SPHERE
EXPORT void sphere_images_of(int64_t n, const double *mx, const double *my, const double *mz, const Node *node, double *alpha,
                             double *delta, double *near, double *far) {
    sphere_images(n, mx, my, mz, node, alpha, delta, near, far);
}
#else
EXPORT void mobius_images(int64_t n, const double *mx, const double *my, double x, double y, double half, double kx,
                          double ky, double *alpha, double *delta, double *near, double *far) {
    images(n, mx, my, x, y, half, kx, ky, alpha, delta, near, far);
}
#endif

/* The bound of each node (cell and window), written into it; the node's kappa becomes that of the bound. */
EXPORT void NAME(bounds)(const Problem *p, Node *nodes, int64_t n, int32_t raster, void *memory, int64_t arena) {
    Work w = work_in(memory, p->points, arena);
    for (int64_t i = 0; i < n; i++) {
        Outcome out;
        Query query = {&nodes[i], 0x1p40, raster && (p->raster || p->own), 0, 0, 0, 0, 1, 0};
        evaluate(p, &w, &query, &out);
        nodes[i].bound = out.bound; nodes[i].kx = out.kx; nodes[i].ky = out.ky;
    }
}

typedef struct { Node node; int64_t offset, entries, free; } Open; /* list of pairs (entries < 0: none), arena in use */

/* A rotation, in turns, that is good for each z, and what it is worth at most: by looking ever closer at the best stretches
   of its window. Worth 0: not above `value`, or not above the z before it, or not looked at before a halt. */
#ifdef SPHERE
EXPORT void NAME(rotations)(const Problem *p, const Node *cells, const double *from,
#else
EXPORT void NAME(rotations)(const Problem *p, const double *x, const double *y, const double *from,
#endif
                             const double *width, double *turns, double *bounds, int64_t n, double value, void *memory, int64_t arena) {
    Work w = work_in(memory, p->points, arena);
    for (int64_t i = 0; i < n; i++) turns[i] = bounds[i] = 0;
    for (int64_t i = 0; i < n; i++) {
        double overstated = 0x1p40; /* the bound over the whole window */
        /* Coarse stretches overstate: the best of them need not hold the best rotation, so all that are nearly as good are
           kept until they no longer shrink; and those that are less good too if none turns out to hold what it seemed to. */
        for (double share = 0.85; share > 0.4 && overstated > value; share -= 0.3) {
            Open open[LOOKS * CLUSTERS + 1];
            int64_t top = 0;
            int depth = 1, raster = p->raster || p->own;
#ifdef SPHERE
            open[0] = (Open){cells[i], 0, -1, 0};
            open[0].node.half = 0;
            open[0].node.from = from[i]; open[0].node.width = width[i]; open[0].node.bound = 0x1p40;
#else
            open[0] = (Open){{x[i], y[i], 0, 0, 0, from[i], width[i], 0x1p40}, 0, -1, 0};
#endif
            for (int looks = 0; depth && looks < LOOKS; looks++) {
                Open seen = open[--depth];
                Node node = seen.node;
                if (node.bound <= value) continue;
                Outcome out;
                const Entry *list = seen.entries < 0 ? 0 : w.arena + seen.offset;
                Entry *children = raster || list ? 0 : w.arena + top;
                int strict = !raster && (seen.free || node.width < 0x1p-6), base = depth;
                Query query = {&node, value, raster, list, seen.entries, children, w.room - top, ALIKE, strict ? 1 : share};
                evaluate(p, &w, &query, &out);
                if (*p->halt) return;
                if (looks == 0) overstated = out.bound;
                if (children && out.entries > 0) { seen.offset = top; seen.entries = out.entries; top += out.entries; }
                for (int c = 0; c < out.clusters; c++) {
                    Open next = seen;
                    next.node.from = out.cluster_from[c]; next.node.width = out.cluster_width[c];
                    next.node.bound = out.cluster_bound[c];
                    if (next.node.width > FULL) { next.node.from = node.from; next.node.width = node.width; }
                    int k = depth++;
                    while (k > base && open[k - 1].node.bound > next.node.bound) { open[k] = open[k - 1]; k--; }
                    open[k] = next;
                }
                if (raster || !out.clusters) { raster = 0; continue; }
                Node best = open[depth - 1].node;
                int shrinks = best.width > SHARP && best.width < 0.9 * node.width;
                if (shrinks || !strict) {
                    if (!shrinks) for (int k = base; k < depth; k++) open[k].free = 1;
                    continue;
                }
                depth = base;
                turns[i] = best.from + 0.5 * best.width;
                bounds[i] = value = best.bound;
            }
            overstated = least(overstated * share, overstated - 1); /* the most that was left out */
        }
    }
}

/* Whether child q of a cell is one that may hold a transformation; its window is moved, on the sphere widened too. */
static int child_of(const Problem *p, const Node *node, int q, Node *child) {
    static const double side[4][2] = {{-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
    double half = node->half / 2, sx = side[q][0] * half, sy = side[q][1] * half;
    *child = *node;
    child->half = half; child->x += sx; child->y += sy;
#ifdef SPHERE
    (void)p;
    if (child->width < 1) { /* ../sphere_bounds.py: windows */
        double l0 = __builtin_sqrt(1 + node->x * node->x + node->y * node->y);
        double l1 = __builtin_sqrt(1 + child->x * child->x + child->y * child->y);
        double det = node->x * child->y - node->y * child->x, dot = 1 + node->x * child->x + node->y * child->y;
        double tilt = axis_radius(node->x, node->y, node->half), small = axis_radius(child->x, child->y, half);
        double wide = (tilt < 0.25 ? 0.51 : 1.05) * tilt * small * PER_RADIAN + 0x1p-40;
        child->from -= 2 * argument(det, l0 * l1 + l0 + l1 + dot) + wide;
        child->width += 2 * wide;
        if (child->width > FULL) { child->from = 0; child->width = 1; }
    }
#else
    double ox = most(positive(child->x) - half, 0), oy = most(positive(child->y) - half, 0);
    if (ox * ox + oy * oy > p->z_max * p->z_max * (1 + 0x1p-50)) return 0;
    if (child->width < 1) child->from -= (child->kx * sy + child->ky * sx) * PER_RADIAN;
#endif
    return 1;
}

/* Search the subtrees of `nodes` depth first for cells whose bound exceeds `value`, at most `budget` bounds each; what is
   left open goes to `left`. Returns how many of `nodes` were taken on (all, unless `left` might overflow, or halted).
   counts: nodes left, bounds computed, arcs laid, bounds that inherited a list of pairs. */
EXPORT int64_t NAME(expand)(const Problem *p, const Node *nodes, int64_t n, double value, int64_t budget, Node *left,
                             int64_t left_room, int64_t *counts, void *memory, int64_t arena) {
    Work w = work_in(memory, p->points, arena);
    Open stack[STACK];
    int64_t bounds = 0, painted = 0, inherited = 0, done = 0, found = 0;
    for (; done < n && found + STACK <= left_room && !*p->halt; done++) {
        int64_t depth = 1, spent = 0;
        stack[0] = (Open){nodes[done], 0, -1, 0};
        while (depth) {
            Open open = stack[--depth];
            if (open.node.bound <= value) continue;
            int64_t most_children = CHILDREN * CLUSTERS * CLUSTERS; /* what follows may push that many */
            if (open.node.half <= p->smallest || spent >= budget || depth + most_children > STACK ||
                found + depth + most_children >= left_room) {
                left[found++] = open.node;
                continue;
            }
            int64_t top = open.free;
            int64_t base = depth;
            int halted = *p->halt;
#ifdef SPHERE
            if (p->weight && open.entries < 0 && open.node.width < NARROW) { /* one list for all children */
                Outcome out;
                Query query = {&open.node, value, 0, 0, 0, w.arena + top, w.room - top, HEAVY_BINS / 16, 0};
                evaluate(p, &w, &query, &out);
                if (!(halted = *p->halt)) {
                    bounds++; spent++; painted += out.painted;
                    if (!out.clusters) continue;
                    open.node.bound = least(open.node.bound, out.bound);
                    if (out.entries > 0) { open.offset = top; open.entries = out.entries; top += out.entries; }
                }
            }
#endif
            for (int q = 0; q < CHILDREN && !halted; q++) {
                Node child;
                if (!child_of(p, &open.node, q, &child)) continue;
                double half = reach_of(&child);
                const Entry *list = open.entries < 0 ? 0 : w.arena + open.offset;
                int gap = (p->weight ? HEAVY_BINS : BINS) / 16, raster = (p->raster || p->own) && half >= p->coarse && !list;
                Outcome coarse, out;
                if (raster) {
                    Query query = {&child, value, 1, 0, 0, 0, 0, p->raster ? RASTER_GAP : gap, 0};
                    evaluate(p, &w, &query, &coarse);
                    if ((halted = *p->halt)) break;
                    bounds++; spent++;
                    child.kx = coarse.kx; child.ky = coarse.ky;
                } else {
                    coarse.clusters = 1; coarse.cluster_bound[0] = UINT32_MAX;
                    coarse.cluster_from[0] = child.from; coarse.cluster_width[0] = child.width;
                }
                for (int c = 0; c < coarse.clusters; c++) {
                    child.from = coarse.cluster_from[c]; child.width = coarse.cluster_width[c];
                    child.bound = least(coarse.cluster_bound[c], open.node.bound);
                    if (child.width > FULL) { child.from = 0; child.width = 1; }
                    if (raster && child.width * (half + p->typical) * p->density > FEW_PAIRS) {
                        stack[depth++] = (Open){child, 0, -1, 0};
                        continue;
                    }
                    Entry *children = child.width < 1 ? w.arena + top : 0;
                    Query query = {&child, value, 0, list, open.entries, children, w.room - top, gap, 0};
                    evaluate(p, &w, &query, &out);
                    if ((halted = *p->halt)) break;
                    bounds++; spent++; painted += out.painted; inherited += list != 0;
                    int64_t kept = children ? out.entries : -1;
                    for (int k = 0; k < out.clusters; k++) {
                        Open *next = &stack[depth++];
                        next->node = child;
                        next->node.kx = out.kx; next->node.ky = out.ky;
                        next->node.bound = least(out.cluster_bound[k], child.bound);
                        next->node.from = out.cluster_from[k]; next->node.width = out.cluster_width[k];
                        if (next->node.width > FULL) { next->node.from = 0; next->node.width = 1; }
                        next->offset = top; next->entries = kept;
                    }
                    if (out.clusters && kept > 0) top += kept;
                }
            }
            if (halted) { /* what was begun counts as not begun; the rest of the stack follows */
                depth = base;
                left[found++] = open.node;
                continue;
            }
            /* the most promising last, that is next; the lists stay in the arena until all of these are done */
            for (int64_t i = base + 1; i < depth; i++) {
                Open key = stack[i];
                int64_t k = i;
                while (k > base && stack[k - 1].node.bound > key.node.bound) { stack[k] = stack[k - 1]; k--; }
                stack[k] = key;
            }
            for (int64_t i = base; i < depth; i++) stack[i].free = top;
        }
    }
    counts[0] = found; counts[1] = bounds; counts[2] = painted; counts[3] = inherited;
    return done;
}
