/* Bounds of the search over Möbius transformations: the inner loops of ../search.py.

   Plain C without a library, for any compiler with vector extensions; built by build_wheel.py, called by ctypes
   (__init__.py). The mathematics and the proofs are in ../bounds.py, of which `images` and `pair_half_width` are the
   same formulas; the equations are those of Le, Chin and Suter (2016).

   Where ../stabbing.py sorts the ends of arcs and sweeps, this file lays arcs over BINS equal stretches of rotations,
   rounded outward to whole stretches, and counts how much each stretch can hold: one bit per stretch and source point
   and carry-save counters if all weights are 1, one 32-bit number per stretch otherwise. Stretches that hold no more
   than the value in hand are dead in every smaller cell too, so the children of a cell look only at the window of
   rotations that is left, in finer stretches, and only at the pairs that reach into it.

   Angles are in turns (1 is the full circle). No operation may be contracted or reassociated: -ffp-contract=off, no
   -ffast-math; then the result is the same on every machine. Rounding: every computed quantity below is off by less
   than SLACK / |1 - conj(m) c|, and moved outward by that (the analysis is in ../bounds.py). */

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#define INTERFACE 4
#define BINS 512      /* stretches of a window, weights all 1 */
#define WORDS (BINS / 64)
#define HEAVY_BINS 256 /* the same, weights differ */
#define PLANES 16      /* fewer than 2^16 source points */
#define STACK 2048     /* open cells of one subtree */
#define CLUSTERS 8     /* windows that the rotations left in one cell are cut into */
#define FULL 0.75      /* a window wider than this is the full circle */

/* The raster: where the match discs lie, in RINGS rings of the disc and FINE angles, for source points that may all
   match the same discs. Four fine angles make one stretch; a row holds every fourth angle, so that the stretches of any
   offset are one row from some bit on (twice the circle, one word to spare). Row (p, q, ring, phase): the rings
   ring .. ring + 2^p - 1, any of the angles 4 t + phase .. 4 t + phase + 2^q - 1. */
#define RINGS 512
#define FINE 2048
#define PHASES (FINE / BINS)
#define SPANS 7
#define SPREADS 10     /* those below FIRST_SPREAD are not needed: a stretch alone takes five fine angles */
#define FIRST_SPREAD 2
#define ROW_WORDS (2 * WORDS + 1)
#define NARROW 0x1p-13 /* half side times width of cells and windows that are bounded by their pairs after the raster */
#define GRID_RINGS 128
#define GRID_SECTORS 64
#define STEADY 0x1p-6  /* half side of cells that take over the common rotation of the cell around them */
#define COARSE 0x1p-10  /* cells with a smaller half side than this see less in the raster than in lists */

static const double SLACK = 0x1p-42;
static const double TURN = 0x1.921fb54442d18p+2; /* radians */
static const double PER_RADIAN = 0x1.45f306dc9c883p-3; /* turns */

typedef struct { /* one cache line */
    double inner, outer;    /* |b| -+ e, moved outward */
    double turn, widest;    /* arg b in turns; the widest half-angle it is seen under, rounded up */
    double tangent, wide;   /* sqrt(b^2 - e^2), and asin(e / b) in turns, rounded up; tangent < 0: see pair_half_width */
    double b, e;            /* |b| and e */
} Pair;

typedef struct {
    int64_t points;         /* N1 */
    const double *mx, *my;  /* source, (N1,) */
    const int64_t *start, *stop; /* row of pairs of each source point, sorted by inner */
    const Pair *pairs;
    const double *inner, *reach; /* of the pairs, and the running maximum of outer along each row */
    const uint32_t *weight; /* NULL: all 1 */
    uint64_t *raster;       /* NULL: rows differ, or weights do; then grid is NULL too */
    const int64_t *grid;    /* the one row sorted by ring and sector of b: where each sector begins */
    const int64_t *nearest_ring, *farthest_ring; /* rings of the grid that hold all discs reaching out of and into a ring */
    const double *ring_wide; /* the largest `widest` in a ring of the grid */
    double z_max, smallest;
} Problem;

typedef struct {
    double x, y, half;      /* cell |Re(z) - x|, |Im(z) - y| <= half */
    double kx, ky;          /* common rotation: theta = window angle - Im(kappa (z - c)) */
    double from, width;     /* window of rotations in turns; width 1: all */
    double bound;           /* no (z, theta) here is worth more */
} Node;

typedef struct { uint32_t point, pair; } Entry;
typedef uint64_t Mask __attribute__((vector_size(8 * WORDS)));
typedef union { Mask all; uint64_t word[WORDS]; } Bits;

typedef struct {
    double *mx, *my, *alpha, *delta, *near, *far, *dx, *dy; /* (N1,) each */
    uint32_t *active;       /* (N1,) */
    Entry *arena;
    int64_t room;
} Work;

typedef struct {
    uint32_t bound;
    int clusters;
    uint32_t cluster_bound[CLUSTERS];
    double cluster_from[CLUSTERS], cluster_width[CLUSTERS];
    int first[CLUSTERS], stop[CLUSTERS]; /* the same in stretches; first < 0: across the end */
    double kx, ky;
    int64_t entries, painted;
} Outcome;

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

/* ../bounds.py: widest_half_angle, in turns. The widest circle is that of the tangents' length, if it is in reach. */
static inline double pair_half_width(const Pair *pair, double near, double far, double tolerance) {
    double rho = near, b = pair->b, e = pair->e;
    if (pair->tangent >= 0) {
        if (far < pair->tangent) rho = far;
        else if (near <= pair->tangent) return pair->wide;
    } else if (near < 0x1p-7) return 1; /* the disc holds the centre, or nearly so */
    double q = ((e - (b - rho)) * (e + (b - rho)) + 0x1p-48) / (4 * rho * b) * (1 + 0x1p-48);
    if (!(q < 1)) return 1;
    if (!(q > 0)) return 0;
    double s = __builtin_sqrt(q);
    if (q * q * s < tolerance * TURN) return 2 * arcsine(s); /* off by less than s^5 / 2 */
    return 2 * (argument(s, __builtin_sqrt(1 - q)) + SLACK * PER_RADIAN);
}

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

static inline int any(Mask m) {
    Bits b; b.all = m; uint64_t x = 0;
    for (int i = 0; i < WORDS; i++) x |= b.word[i];
    return x != 0;
}

#define ADD3(carry, sum, a, b, c) do { Mask u_ = (a) ^ (b), v_ = (c); carry = ((a) & (b)) | (u_ & v_); sum = u_ ^ v_; } while (0)

typedef struct {
    Mask plane[PLANES];     /* bit i of each stretch's count */
    Bits pending[8];
    int waiting;
} Counter;

static void counter_flush(Counter *c) {
    Mask zero = {0};
    for (int i = c->waiting; i < 8; i++) c->pending[i].all = zero;
    Mask a, b, d, e, twos_a, twos_b, fours_a, fours_b, carry;
    ADD3(twos_a, c->plane[0], c->plane[0], c->pending[0].all, c->pending[1].all);
    ADD3(twos_b, c->plane[0], c->plane[0], c->pending[2].all, c->pending[3].all);
    ADD3(fours_a, c->plane[1], c->plane[1], twos_a, twos_b);
    ADD3(a, c->plane[0], c->plane[0], c->pending[4].all, c->pending[5].all);
    ADD3(b, c->plane[0], c->plane[0], c->pending[6].all, c->pending[7].all);
    ADD3(fours_b, c->plane[1], c->plane[1], a, b);
    ADD3(carry, c->plane[2], c->plane[2], fours_a, fours_b);
    for (int i = 3; i < PLANES; i++) {
        d = c->plane[i] & carry;
        e = c->plane[i] ^ carry;
        c->plane[i] = e;
        carry = d;
        if (!any(carry)) break;
    }
    c->waiting = 0;
}

/* The stretches that hold more than `value`, and the largest count among `among`. */
static Mask counter_above(const Counter *c, int64_t value) {
    Mask zero = {0}, above = zero, equal = ~zero;
    if (value < 0) return equal;
    if (value >= (int64_t)1 << PLANES) return zero;
    for (int i = PLANES - 1; i >= 0; i--) {
        if (value >> i & 1) equal &= c->plane[i];
        else { above |= equal & c->plane[i]; equal &= ~c->plane[i]; }
    }
    return above;
}

static uint32_t counter_most(const Counter *c, Mask among) {
    uint32_t count = 0;
    for (int i = PLANES - 1; i >= 0; i--) {
        Mask t = among & c->plane[i];
        if (any(t)) { among = t; count |= (uint32_t)1 << i; }
    }
    return count;
}

static inline int stretch(double position, int bins) { return position < bins ? (int)position : bins - 1; }

static uint64_t *raster_row(uint64_t *raster, int span, int spread, int ring, int phase) {
    size_t row = (((size_t)span * (SPREADS - FIRST_SPREAD) + spread - FIRST_SPREAD) * RINGS + ring) * PHASES + phase;
    return raster + row * ROW_WORDS;
}

/* The union of two rows from word `from`, bit `bit` on. */
static inline Mask rows_from(const uint64_t *a, const uint64_t *b, int from, int bit) {
    Bits low, high;
    a += from; b += from;
    for (int i = 0; i < WORDS; i++) { low.word[i] = a[i] | b[i]; high.word[i] = a[i + 1] | b[i + 1]; }
    return bit ? low.all >> bit | high.all << (64 - bit) : low.all;
}

static int fine_angle(double turns) { return (int)(int64_t)whole(turns * FINE); }

/* Draw the discs of the one row of pairs. */
EXPORT int64_t mobius_raster_bytes(void) {
    return (int64_t)sizeof(uint64_t) * SPANS * (SPREADS - FIRST_SPREAD) * RINGS * PHASES * ROW_WORDS;
}

EXPORT void mobius_raster(const Problem *p) {
    uint64_t *raster = p->raster;
    Mask zero = {0};
    for (int ring = 0; ring < RINGS; ring++) {
        Bits phase[PHASES], next[PHASES];
        for (int f = 0; f < PHASES; f++) phase[f].all = zero;
        double near = ring * (1.0 / RINGS), far = (ring + 1) * (1.0 / RINGS);
        for (int64_t k = p->start[0]; k < p->stop[0]; k++) {
            const Pair *pair = p->pairs + k;
            if (pair->outer < near || pair->inner > far) continue;
            double half_width = pair_half_width(pair, near, far, 0x1p-14) + SLACK;
            int first = fine_angle(pair->turn - half_width), last = fine_angle(pair->turn + half_width);
            if (2 * half_width >= 1 || last - first >= FINE) { first = 0; last = FINE - 1; }
            for (int i = first; i <= last; i++) {
                int bit = (i & (FINE - 1)) / PHASES;
                phase[i & (PHASES - 1)].word[bit >> 6] |= (uint64_t)1 << (bit & 63);
            }
        }
        /* widen by doubling: D_(q+1)(i) = D_q(i) | D_q(i + 2^q) */
        for (int q = 0; q < SPREADS; q++) {
            uint64_t twice[PHASES][ROW_WORDS];
            for (int f = 0; f < PHASES; f++)
                for (int i = 0; i < ROW_WORDS; i++) twice[f][i] = phase[f].word[i % WORDS];
            for (int f = 0; f < PHASES; f++) {
                if (q >= FIRST_SPREAD)
                    for (int i = 0; i < ROW_WORDS; i++) raster_row(raster, 0, q, ring, f)[i] = twice[f][i];
                int angle = f + (1 << q);
                const uint64_t *row = twice[angle % PHASES];
                int shift = angle / PHASES % BINS;
                next[f].all = phase[f].all | rows_from(row, row, shift >> 6, shift & 63);
            }
            for (int f = 0; f < PHASES; f++) phase[f] = next[f];
        }
    }
    for (int span = 1; span < SPANS; span++)
        for (int q = FIRST_SPREAD; q < SPREADS; q++)
            for (int ring = 0; ring < RINGS; ring++) {
                int other = ring + (1 << (span - 1));
                uint64_t *row = raster_row(raster, span, q, ring, 0);
                const uint64_t *a = raster_row(raster, span - 1, q, ring, 0);
                const uint64_t *b = raster_row(raster, span - 1, q, other < RINGS ? other : ring, 0);
                for (int i = 0; i < PHASES * ROW_WORDS; i++) row[i] = a[i] | b[i];
            }
}

/* The stretches of all rotations that bring an image at alpha +- delta, [near, far] onto a disc, at least. */
static inline Mask raster_mask(const uint64_t *raster, double near, double far, double alpha, double delta) {
    Mask found = {0}, nowhere = {0};
    int inside = (int)(near * RINGS), outside = (int)(far * RINGS);
    if (inside > RINGS - 1) inside = RINGS - 1;
    if (outside > RINGS - 1) outside = RINGS - 1;
    int first = 0, count = FINE;
    if (delta < 0.25) {
        first = fine_angle(alpha - delta);
        count = fine_angle(alpha + delta) + PHASES + 1 - first;
    }
    int everywhere = count > 2 << (SPREADS - 1);
    int spread = everywhere ? SPREADS - 1 : 31 - __builtin_clz((unsigned)count);
    if (spread > SPREADS - 1) spread = SPREADS - 1;
    int second = first + count - (1 << spread);
    first &= FINE - 1; second &= FINE - 1;
    int span = 31 - __builtin_clz((unsigned)(outside - inside + 1));
    if (span > SPANS - 1) span = SPANS - 1;
    /* two rows overlap to cover the rings, unless there are very many */
    for (int ring = inside; ring <= outside; ring += 2 << span) {
        int other = ring + (1 << span), last = outside - (1 << span) + 1;
        const uint64_t *a = raster_row((uint64_t *)raster, span, spread, ring < last ? ring : last, 0);
        const uint64_t *b = raster_row((uint64_t *)raster, span, spread, other < last ? other : last, 0);
        found |= rows_from(a, b, (first & (PHASES - 1)) * ROW_WORDS + first / (64 * PHASES), first / PHASES & 63);
        found |= rows_from(a, b, (second & (PHASES - 1)) * ROW_WORDS + second / (64 * PHASES), second / PHASES & 63);
    }
    if (everywhere) return any(found) ? ~nowhere : nowhere;
    return found;
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

/* Cut the live stretches into windows: more than `gap` dead ones separate two. With gap 0 keep the widest only. */
static void cluster(const uint64_t *live, int bins, double from, double width, int gap, Outcome *out) {
    int n = 0, start = -1, stop = -1;
    for (int w = 0; w <= bins / 64; w++) {
        uint64_t x = w < bins / 64 ? live[w] : 1; /* the last is a sentinel that closes the last window */
        while (x) {
            int bit = __builtin_ctzll(x), length = 1;
            if (w < bins / 64) {
                uint64_t rest = ~(x >> bit);
                length = rest ? __builtin_ctzll(rest) : 64;
                if (length > 64 - bit) length = 64 - bit;
            }
            x = bit + length < 64 ? x >> (bit + length) << (bit + length) : 0;
            int at = 64 * w + bit;
            if (start >= 0 && at < bins && at - stop <= gap) { stop = at + length; continue; }
            if (start >= 0) {
                if (gap == 0) {
                    if (n == 0 || stop - start > out->stop[0] - out->first[0]) { out->first[0] = start; out->stop[0] = stop; }
                    n = 1;
                } else if (n == CLUSTERS) out->stop[n - 1] = stop;
                else { out->first[n] = start; out->stop[n++] = stop; }
            }
            start = at; stop = at + length;
            if (w == bins / 64) break;
        }
    }
    if (n > 1 && width >= 1 && out->first[0] + bins - out->stop[n - 1] <= gap) out->first[0] = out->first[--n] - bins;
    for (int c = 0; c < n; c++) {
        out->cluster_from[c] = from + out->first[c] * (width / bins);
        out->cluster_width[c] = (out->stop[c] - out->first[c]) * (width / bins);
    }
    out->clusters = n;
}

/* What to bound: a cell and a window, over `entries` pairs if not NULL (those of a cell and window around these), over
   the raster if not NULL (then always of the full circle), or over all pairs. Only stretches worth more than `value`
   count, and with gap 0 only the best of them. `children`: where the pairs that reach into the window go, or NULL. */
typedef struct {
    const Node *node;
    double value;
    const uint64_t *raster;
    const Entry *parents;
    int64_t entries;
    Entry *children;
    int64_t room;
    int gap;
} Query;

typedef struct {
    const Problem *p;
    const Query *q;
    Outcome *out;
    double from, width, middle, reach, scale; /* the window */
    double fine;            /* a small part of a stretch */
    int bins;
    Counter counter;
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
        const Pair *pair = p->pairs + number;
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
        while (a < b) { int64_t mid = (a + b) / 2; if (p->inner[mid] <= far) a = mid + 1; else b = mid; }
        return lay_pairs(l, j, 0, low, a, near, far, alpha, delta, bits);
    }
    int inside = (int)(near * GRID_RINGS), outside = (int)(far * GRID_RINGS), touched = 0;
    inside = (int)p->nearest_ring[inside < GRID_RINGS ? inside : GRID_RINGS - 1];
    outside = (int)p->farthest_ring[outside < GRID_RINGS ? outside : GRID_RINGS - 1];
    if (l->width >= 1 || delta > 0.25) {
        if (inside > outside) return 0;
        return lay_pairs(l, j, 0, p->grid[inside * GRID_SECTORS], p->grid[(outside + 1) * GRID_SECTORS], near, far, alpha,
                         delta, bits);
    }
    for (int ring = inside; ring <= outside; ring++) {
        double margin = delta + p->ring_wide[ring] + 0x1p-40, begin = alpha + l->from - margin;
        double end = begin + l->width + 2 * margin;
        const int64_t *sectors = p->grid + ring * GRID_SECTORS;
        if (end - begin > 1 - 2.0 / GRID_SECTORS) {
            touched |= lay_pairs(l, j, 0, sectors[0], sectors[GRID_SECTORS], near, far, alpha, delta, bits);
            continue;
        }
        int first = (int)whole(begin * GRID_SECTORS), count = (int)whole(end * GRID_SECTORS) - first + 1;
        first &= GRID_SECTORS - 1;
        int stop = first + count;
        touched |= lay_pairs(l, j, 0, sectors[first], sectors[stop < GRID_SECTORS ? stop : GRID_SECTORS], near, far, alpha,
                             delta, bits);
        if (stop > GRID_SECTORS)
            touched |= lay_pairs(l, j, 0, sectors[0], sectors[stop - GRID_SECTORS], near, far, alpha, delta, bits);
    }
    return touched;
}

/* Bound Q over a cell and a window, which is moved and widened from the parent's kappa to ours. */
static void evaluate(const Problem *p, Work *w, const Query *q, Outcome *out) {
    const Node *node = q->node;
    int64_t n = 0;
    const double *mx = p->mx, *my = p->my;
    if (q->parents) {
        for (int64_t i = 0; i < q->entries; i++)
            if (n == 0 || w->active[n - 1] != q->parents[i].point) {
                uint32_t j = q->parents[i].point;
                w->mx[n] = p->mx[j]; w->my[n] = p->my[j]; w->active[n++] = j;
            }
        mx = w->mx; my = w->my;
    } else n = p->points;

    double kx = node->kx, ky = node->ky;
    if (node->half > STEADY) {
        slopes(n, mx, my, node->x, node->y, w->dx, w->dy);
        common_rotation(n, w->dx, w->dy, &kx, &ky);
        common_rotation(n, w->dx, w->dy, &kx, &ky);
    }
    out->kx = kx; out->ky = ky;
    images(n, mx, my, node->x, node->y, node->half, kx, ky, w->alpha, w->delta, w->near, w->far);

    Laying l;
    l.p = p; l.q = q; l.out = out;
    l.from = node->from; l.width = node->width;
    if (l.width < 1) {
        double shift = node->half * (positive(kx - node->kx) + positive(ky - node->ky)) * PER_RADIAN + 0x1p-40;
        l.from -= shift; l.width += 2 * shift;
        if (l.width > FULL) { l.from = 0; l.width = 1; }
    }
    Bits window;
    Mask zero = {0};
    window.all = ~zero;
    if (q->raster && l.width < 1) {
        window.all = zero;
        lay(l.from + l.width / 2, l.width / 2 + 0x1p-40, 0, 1, BINS, BINS, window.word, 0, 1);
        l.from = 0; l.width = 1;
    }
    l.bins = p->weight ? HEAVY_BINS : BINS;
    l.scale = l.bins / l.width;
    l.fine = l.width / l.bins / 32;
    l.middle = l.from + l.width / 2; l.reach = l.width / 2 + 0x1p-40;
    l.whole = 0;
    if (p->weight) for (int k = 0; k < HEAVY_BINS; k++) l.total[k] = 0;
    else {
        for (int i = 0; i < PLANES; i++) l.counter.plane[i] = zero;
        l.counter.waiting = 0;
    }
    out->entries = 0; out->painted = 0; out->clusters = 0;
    int64_t cursor = 0;
    for (int64_t i = 0; i < n; i++) {
        double near = w->near[i], far = w->far[i], alpha = w->alpha[i], delta = w->delta[i];
        Bits *bits = &l.counter.pending[l.counter.waiting];
        if (q->raster) {
            bits->all = raster_mask(q->raster, near, far, alpha, delta);
            if (++l.counter.waiting == 8) counter_flush(&l.counter);
            continue;
        }
        uint32_t j = q->parents ? w->active[i] : (uint32_t)i;
        l.row.whole = 0; l.row.clean = 1;
        if (!p->weight) bits->all = zero;
        int touched;
        if (q->parents) {
            int64_t low = cursor;
            while (cursor < q->entries && q->parents[cursor].point == j) cursor++;
            touched = lay_pairs(&l, j, q->parents, low, cursor, near, far, alpha, delta, p->weight ? 0 : bits->word);
        } else touched = lay_row(&l, j, near, far, alpha, delta, p->weight ? 0 : bits->word);
        if (!touched) continue;
        if (p->weight) {
            uint32_t all = l.row.whole;
            l.whole += all;
            if (!l.row.clean)
                for (int k = 0; k < HEAVY_BINS; k++)
                    l.total[k] += l.row.stretch[k] > all ? l.row.stretch[k] - all : 0;
        } else if (++l.counter.waiting == 8) counter_flush(&l.counter);
    }
    if (q->children && out->entries > q->room) out->entries = -1; /* too many to keep */

    if (p->weight) {
        uint32_t best = 0;
        for (int k = 0; k < HEAVY_BINS; k++) {
            l.total[k] += l.whole;
            best = l.total[k] > best ? l.total[k] : best;
        }
        out->bound = best;
        if ((double)best <= q->value) return;
        uint64_t live[HEAVY_BINS / 64] = {0};
        double value = q->gap ? q->value : best - 1.0;
        for (int k = 0; k < HEAVY_BINS; k++) live[k >> 6] |= (uint64_t)((double)l.total[k] > value) << (k & 63);
        cluster(live, HEAVY_BINS, l.from, l.width, q->gap, out);
        for (int c = 0; c < out->clusters; c++) {
            out->cluster_bound[c] = 0;
            for (int k = out->first[c]; k < out->stop[c]; k++) {
                uint32_t t = l.total[k < 0 ? k + HEAVY_BINS : k];
                if (t > out->cluster_bound[c]) out->cluster_bound[c] = t;
            }
        }
        return;
    }
    if (l.counter.waiting) counter_flush(&l.counter);
    out->bound = counter_most(&l.counter, window.all);
    if ((double)out->bound <= q->value) return;
    double value = q->gap ? q->value : out->bound - 1.0;
    Bits above;
    above.all = window.all & counter_above(&l.counter, value < 0 ? -1 : (int64_t)value);
    cluster(above.word, BINS, l.from, l.width, q->gap, out);
    for (int c = 0; c < out->clusters; c++) {
        Bits among;
        among.all = zero;
        int first = out->first[c], stop = out->stop[c];
        if (first < 0) { paint(among.word, first + BINS, BINS - 1); first = 0; }
        paint(among.word, first, stop - 1);
        out->cluster_bound[c] = counter_most(&l.counter, among.all & above.all);
    }
}

static int64_t doubles_of(int64_t points) { return 8 * points; }

/* Bytes of working memory that each thread must bring. */
EXPORT int64_t mobius_work_bytes(int64_t points, int64_t arena) {
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

/* For the tests: what `images` makes of one cell, with the common rotation given. */
EXPORT void mobius_images(int64_t n, const double *mx, const double *my, double x, double y, double half, double kx,
                          double ky, double *alpha, double *delta, double *near, double *far) {
    images(n, mx, my, x, y, half, kx, ky, alpha, delta, near, far);
}

/* The bound of each node (cell and window), written into it; the node's kappa becomes that of the bound. */
EXPORT void mobius_bounds(const Problem *p, Node *nodes, int64_t n, int32_t raster, void *memory, int64_t arena) {
    Work w = work_in(memory, p->points, arena);
    for (int64_t i = 0; i < n; i++) {
        Outcome out;
        Query query = {&nodes[i], 0x1p40, raster ? p->raster : 0, 0, 0, 0, 0, 1};
        evaluate(p, &w, &query, &out);
        nodes[i].bound = out.bound; nodes[i].kx = out.kx; nodes[i].ky = out.ky;
    }
}

/* A rotation, in turns, that is good for each z, and what it is worth at most: by looking ever closer at the best stretch,
   from a window on. Worth 0: not above `value`, or not above the z before it. */
EXPORT void mobius_rotations(const Problem *p, const double *x, const double *y, double from, double width,
                             double *turns, double *bounds, int64_t n, double value, void *memory, int64_t arena) {
    Work w = work_in(memory, p->points, arena);
    for (int64_t i = 0; i < n; i++) {
        Node node = {x[i], y[i], 0, 0, 0, from, width, 0};
        Outcome out;
        turns[i] = bounds[i] = 0;
        Query query = {&node, value, p->raster, 0, 0, 0, 0, 0};
        if (p->raster && width >= 1) {
            evaluate(p, &w, &query, &out);
            if (out.bound <= value) continue;
        }
        query.raster = 0;
        for (int zoom = 0; zoom < 5; zoom++) {
            evaluate(p, &w, &query, &out);
            bounds[i] = out.bound;
            if (!out.clusters) break;
            turns[i] = out.cluster_from[0] + 0.5 * out.cluster_width[0];
            if (out.cluster_width[0] > FULL) break;
            node.from = out.cluster_from[0]; node.width = out.cluster_width[0];
        }
        if (bounds[i] > value) value = bounds[i];
        else bounds[i] = 0;
    }
}

typedef struct { Node node; int64_t offset, entries, free; } Open; /* list of pairs (entries < 0: none), arena in use */

/* Search the subtrees of `nodes` depth first for cells whose bound exceeds `value`, at most `budget` bounds each; what is
   left open goes to `left`. Returns how many of `nodes` were taken on (all, unless `left` might overflow).
   counts: nodes left, bounds computed, arcs laid, bounds that inherited a list of pairs. */
EXPORT int64_t mobius_expand(const Problem *p, const Node *nodes, int64_t n, double value, int64_t budget, Node *left,
                             int64_t left_room, int64_t *counts, void *memory, int64_t arena) {
    static const double side[4][2] = {{-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
    Work w = work_in(memory, p->points, arena);
    Open stack[STACK];
    int64_t bounds = 0, painted = 0, inherited = 0, done = 0, found = 0;
    for (; done < n && found + STACK <= left_room; done++) {
        int64_t depth = 1, spent = 0;
        stack[0] = (Open){nodes[done], 0, -1, 0};
        while (depth) {
            Open open = stack[--depth];
            if (open.node.bound <= value) continue;
            int64_t most_children = 4 * CLUSTERS * CLUSTERS; /* what follows may push that many */
            if (open.node.half <= p->smallest || spent >= budget || depth + most_children > STACK ||
                found + depth + most_children >= left_room) {
                left[found++] = open.node;
                continue;
            }
            int64_t top = open.free;
            int64_t base = depth;
            double half = open.node.half / 2;
            for (int q = 0; q < 4; q++) {
                Node child = open.node;
                double sx = side[q][0] * half, sy = side[q][1] * half;
                child.half = half; child.x += sx; child.y += sy;
                double ox = most(positive(child.x) - half, 0), oy = most(positive(child.y) - half, 0);
                if (ox * ox + oy * oy > p->z_max * p->z_max * (1 + 0x1p-50)) continue;
                if (child.width < 1) child.from -= (child.kx * sy + child.ky * sx) * PER_RADIAN;
                const Entry *list = open.entries < 0 ? 0 : w.arena + open.offset;
                int gap = p->weight ? HEAVY_BINS / 16 : BINS / 16, raster = p->raster && half >= COARSE && !list;
                Outcome coarse, out;
                if (raster) {
                    Query query = {&child, value, p->raster, 0, 0, 0, 0, gap};
                    evaluate(p, &w, &query, &coarse);
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
                    if (raster && child.width * half > NARROW) {
                        stack[depth++] = (Open){child, 0, -1, 0};
                        continue;
                    }
                    Entry *children = child.width < 1 ? w.arena + top : 0;
                    Query query = {&child, value, 0, list, open.entries, children, w.room - top, gap};
                    evaluate(p, &w, &query, &out);
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
