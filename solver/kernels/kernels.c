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

#define INTERFACE 1
#define BINS 512      /* stretches of a window, weights all 1 */
#define WORDS (BINS / 64)
#define HEAVY_BINS 256 /* the same, weights differ */
#define PLANES 16      /* fewer than 2^16 source points */
#define STACK 2048     /* open cells of one subtree */
#define CLUSTERS 8     /* windows that the rotations left in one cell are cut into */
#define FULL 0.75      /* a window wider than this is the full circle */

static const double SLACK = 0x1p-42;
static const double TURN = 0x1.921fb54442d18p+2; /* radians */
static const double PER_RADIAN = 0x1.45f306dc9c883p-3; /* turns */

typedef struct {
    int64_t points;         /* N1 */
    const double *mx, *my;  /* source, (N1,) */
    const int64_t *start, *stop; /* row of pairs of each source point, sorted by inner */
    const double *inner, *outer, *reach; /* |b| -+ e moved outward, and the running maximum of outer along its row */
    const double *b, *e, *turn; /* |b|, e, arg b in turns */
    const double *tangent, *wide; /* sqrt(b^2 - e^2) and asin(e / b) in turns, rounded up; tangent < 0: see below */
    const uint32_t *weight; /* NULL: all 1 */
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
    double t = low / (high > 0 ? high : 1);
    int upper = t > 0.41421356237309503;
    t = upper ? (t - 1) / (t + 1) : t;
    double q = t * t, s = 1.0 / 35;
    s = 1.0 / 33 - q * s; s = 1.0 / 31 - q * s; s = 1.0 / 29 - q * s; s = 1.0 / 27 - q * s; s = 1.0 / 25 - q * s;
    s = 1.0 / 23 - q * s; s = 1.0 / 21 - q * s; s = 1.0 / 19 - q * s; s = 1.0 / 17 - q * s; s = 1.0 / 15 - q * s;
    s = 1.0 / 13 - q * s; s = 1.0 / 11 - q * s; s = 1.0 / 9 - q * s; s = 1.0 / 7 - q * s; s = 1.0 / 5 - q * s;
    s = 1.0 / 3 - q * s; s = 1 - q * s;
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
        double a = __builtin_sqrt(a2), f = __builtin_sqrt(f2), m = __builtin_sqrt(m2);
        double ia = 1 / a2, jf = 1 / f2, slack = SLACK / f;
        double s1 = r / a, s2 = m * r / f;
        int pole = (f < 0x1p-16) | (s2 > 1 - 0x1p-10);
        int turns = pole | (s1 > 1 - 0x1p-30);
        double t1 = turns ? 0 : s1, t2 = turns ? 0 : s2;
        double rest = t1 * t1 / (2 - 2 * t1) + t2 * t2 / (2 - 2 * t2);
        double ux = ax * ia, uy = -ay * ia, vx = (x * fx - y * fy) * jf, vy = -(x * fy + y * fx) * jf;
        double linear = half * (positive(ux + vx + kx) + positive(uy + vy + ky)) + rest;
        double angle = least(linear * PER_RADIAN, arcsine(t1) + arcsine(t2) + common * PER_RADIAN) + slack * PER_RADIAN;
        alpha[j] = argument(ax * fy + ay * fx, ax * fx - ay * fy);
        delta[j] = turns ? 1 : angle;

        double span = pole ? 1 : f2 - m2 * r * r;
        double gx = x * r * r - (ax * fx + ay * fy), gy = y * r * r - (ay * fx - ax * fy);
        double middle = __builtin_sqrt(gx * gx + gy * gy) / span;
        double spread = r * most(1 - m2, 0) / span;
        double off = SLACK * (1 + middle + spread) / span;
        double low = middle - spread - off, high = middle + spread + off;
        double growth = half * (positive(ux - vx) + positive(uy - vy)) + rest + slack;
        double h = a / f;
        int flat = (!turns) & (growth < 1);
        low = flat ? most(low, h * (1 - growth) - slack) : low;
        high = flat ? least(high, h * (1 + growth + growth * growth) + slack) : high;
        near[j] = pole ? 0 : most(low, 0);
        far[j] = pole ? 1 : least(most(high, low), 1);
    }
}

/* ../bounds.py: widest_half_angle, in turns. The widest circle is that of the tangents' length, if it is in reach. */
static inline double pair_half_width(const Problem *p, int64_t k, double near, double far, double tolerance) {
    double rho = near, b = p->b[k], e = p->e[k];
    if (p->tangent[k] >= 0) {
        if (far < p->tangent[k]) rho = far;
        else if (near <= p->tangent[k]) return p->wide[k];
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

static inline void paint_heavy(uint32_t *row, int low, int high, uint32_t weight) {
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
    int waiting, planes;
    uint32_t everywhere;    /* points that reach every stretch */
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
        if (i >= c->planes) c->planes = i + 1;
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

/* Lay the arc over the window; returns whether it reaches into it. `bits` or `row` is painted. */
static inline int lay(double centre, double half_width, double from, double width, int bins, double scale,
                      uint64_t *bits, uint32_t *row, uint32_t weight) {
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
static void cluster(const uint8_t *live, const uint32_t *count, int bins, double from, double width, int gap,
                    Outcome *out) {
    int cyclic = width >= 1, offset = 0;
    out->clusters = 0;
    if (cyclic) { /* begin after the longest gap */
        int longest = 0, run = 0;
        for (int i = 0; i < 2 * bins; i++) {
            run = live[i % bins] ? 0 : run + 1;
            if (run > longest) { longest = run; offset = (i + 1) % bins; }
        }
        if (longest >= bins) return;
        if (longest < gap) offset = 0;
    }
    int first = -1, last = -1;
    uint32_t best = 0;
    for (int i = 0; i <= bins; i++) {
        int bin = i < bins ? (i + offset) % bins : 0, on = i < bins && live[bin];
        int close = first >= 0 && (i == bins || (on && i - last - 1 > gap && (!gap || out->clusters < CLUSTERS - 1)));
        if (close) {
            int n = gap ? out->clusters++ : 0;
            double wide = (last + 1 - first) * (width / bins);
            if (gap || !out->clusters || wide > out->cluster_width[0]) {
                out->clusters = n + 1;
                out->cluster_bound[n] = best;
                out->cluster_from[n] = from + (first + offset) * (width / bins);
                out->cluster_width[n] = wide;
            }
            first = -1;
        }
        if (on) {
            if (first < 0) { first = i; best = 0; }
            if (count[bin] > best) best = count[bin];
            last = i;
        }
    }
}

/* Bound Q over a cell and a window. `parents`: the pairs of a cell and window around these, or NULL; `children`: where
   the pairs that reach into this window go, or NULL. The window is moved and widened from the parent's kappa to ours. */
static void evaluate(const Problem *p, Work *w, const Node *node, double value, const Entry *parents, int64_t entries,
                     Entry *children, int64_t room, int gap, Outcome *out) {
    int64_t n = 0;
    const double *mx = p->mx, *my = p->my;
    if (parents) {
        for (int64_t i = 0; i < entries; i++)
            if (n == 0 || w->active[n - 1] != parents[i].point) {
                uint32_t j = parents[i].point;
                w->mx[n] = p->mx[j]; w->my[n] = p->my[j]; w->active[n++] = j;
            }
        mx = w->mx; my = w->my;
    } else n = p->points;

    double kx = node->kx, ky = node->ky;
    slopes(n, mx, my, node->x, node->y, w->dx, w->dy);
    common_rotation(n, w->dx, w->dy, &kx, &ky);
    if (node->half > 0.02) common_rotation(n, w->dx, w->dy, &kx, &ky);
    out->kx = kx; out->ky = ky;
    images(n, mx, my, node->x, node->y, node->half, kx, ky, w->alpha, w->delta, w->near, w->far);

    double from = node->from, width = node->width;
    if (width < 1) {
        double shift = node->half * (positive(kx - node->kx) + positive(ky - node->ky)) * PER_RADIAN + 0x1p-40;
        from -= shift; width += 2 * shift;
        if (width > FULL) { from = 0; width = 1; }
    }
    int bins = p->weight ? HEAVY_BINS : BINS;
    double scale = bins / width;

    Counter counter;
    uint32_t total[HEAVY_BINS], row[HEAVY_BINS];
    Mask zero = {0};
    if (p->weight) for (int i = 0; i < HEAVY_BINS; i++) total[i] = 0;
    else {
        for (int i = 0; i < PLANES; i++) counter.plane[i] = zero;
        counter.waiting = 0; counter.planes = 3; counter.everywhere = 0;
    }
    out->entries = 0; out->painted = 0;
    int64_t cursor = 0;
    for (int64_t i = 0; i < n; i++) {
        uint32_t j = parents ? w->active[i] : (uint32_t)i;
        double near = w->near[i], far = w->far[i], alpha = w->alpha[i], delta = w->delta[i];
        uint64_t *bits = 0;
        if (p->weight) for (int k = 0; k < HEAVY_BINS; k++) row[k] = 0;
        else { counter.pending[counter.waiting].all = zero; bits = counter.pending[counter.waiting].word; }
        int64_t low, high;
        if (parents) {
            low = cursor;
            while (cursor < entries && parents[cursor].point == j) cursor++;
            high = cursor;
        } else {
            int64_t a = p->start[j], b = p->stop[j], c = b;
            while (a < b) { int64_t mid = (a + b) / 2; if (p->reach[mid] < near) a = mid + 1; else b = mid; }
            low = a;
            b = c;
            while (a < b) { int64_t mid = (a + b) / 2; if (p->inner[mid] <= far) a = mid + 1; else b = mid; }
            high = a;
        }
        int touched = 0;
        for (int64_t k = low; k < high; k++) {
            int64_t pair = parents ? parents[k].pair : k;
            if (p->outer[pair] < near || p->inner[pair] > far) continue;
            double half_width = delta + pair_half_width(p, pair, near, far, delta / 32);
            if (!lay(p->turn[pair] - alpha, half_width, from, width, bins, scale, bits, row,
                     p->weight ? p->weight[pair] : 1)) continue;
            touched = 1;
            out->painted++;
            if (children) {
                if (out->entries < room) { children[out->entries].point = j; children[out->entries].pair = (uint32_t)pair; }
                out->entries++;
            }
        }
        if (!touched) continue;
        if (p->weight) for (int k = 0; k < HEAVY_BINS; k++) total[k] += row[k];
        else if (++counter.waiting == 8) counter_flush(&counter);
    }
    if (children && out->entries > room) out->entries = -1; /* too many to keep */

    uint8_t live[BINS];
    uint32_t count[BINS];
    if (p->weight) {
        uint32_t best = 0;
        for (int k = 0; k < HEAVY_BINS; k++) best = total[k] > best ? total[k] : best;
        out->bound = best;
        out->clusters = 0;
        if ((double)best <= value) return;
        for (int k = 0; k < HEAVY_BINS; k++) { live[k] = (double)total[k] > value; count[k] = total[k]; }
    } else {
        if (counter.waiting) counter_flush(&counter);
        Mask above = counter_above(&counter, value < 0 ? -1 : (int64_t)value);
        out->bound = counter_most(&counter, ~zero);
        out->clusters = 0;
        if (!any(above)) return;
        Bits b; b.all = above;
        for (int k = 0; k < BINS; k++) {
            live[k] = b.word[k >> 6] >> (k & 63) & 1;
            count[k] = out->bound;
        }
        if (width >= 1 || out->bound > value + 1) /* otherwise every live count is the largest */
            for (int k = 0; k < BINS; k++) {
                if (!live[k]) continue;
                uint32_t t = 0;
                for (int i = 0; i < PLANES; i++) { Bits q; q.all = counter.plane[i]; t |= (uint32_t)(q.word[k >> 6] >> (k & 63) & 1) << i; }
                count[k] = t;
            }
    }
    cluster(live, count, bins, from, width, gap, out);
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
EXPORT void mobius_bounds(const Problem *p, Node *nodes, int64_t n, void *memory, int64_t arena) {
    Work w = work_in(memory, p->points, arena);
    for (int64_t i = 0; i < n; i++) {
        Outcome out;
        evaluate(p, &w, &nodes[i], 0x1p40, 0, 0, 0, 0, 0, &out);
        nodes[i].bound = out.bound; nodes[i].kx = out.kx; nodes[i].ky = out.ky;
    }
}

/* U(z) from above, to rounding, and a rotation, in turns, of the best stretch, for each z: by looking ever closer at it.
   Given up early where U(z) is not above `value`. */
EXPORT void mobius_rotations(const Problem *p, const double *x, const double *y, double *turns, double *bounds,
                             int64_t n, double value, void *memory, int64_t arena) {
    Work w = work_in(memory, p->points, arena);
    for (int64_t i = 0; i < n; i++) {
        Node node = {x[i], y[i], 0, 0, 0, 0, 1, 0};
        Outcome out;
        turns[i] = 0;
        double best = 0x1p40;
        for (int zoom = 0; zoom < 5; zoom++) {
            evaluate(p, &w, &node, best - 1, 0, 0, 0, 0, 0, &out);
            bounds[i] = best = out.bound;
            if (best <= value) break;
            if (!out.clusters) evaluate(p, &w, &node, best - 1, 0, 0, 0, 0, 0, &out);
            turns[i] = out.cluster_from[0] + 0.5 * out.cluster_width[0];
            if (best == 0 || out.cluster_width[0] > FULL) break;
            node.from = out.cluster_from[0]; node.width = out.cluster_width[0];
        }
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
            if (open.node.half <= p->smallest || spent >= budget || depth + 4 * CLUSTERS > STACK) {
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
                int windowed = child.width < 1;
                Outcome out;
                evaluate(p, &w, &child, value, open.entries < 0 ? 0 : w.arena + open.offset, open.entries,
                         windowed ? w.arena + top : 0, windowed ? w.room - top : 0,
                         p->weight ? HEAVY_BINS / 16 : BINS / 16, &out);
                bounds++; spent++; painted += out.painted; inherited += open.entries >= 0;
                int64_t kept = windowed ? out.entries : -1;
                for (int k = 0; k < out.clusters; k++) {
                    Open *next = &stack[depth++];
                    next->node = child;
                    next->node.kx = out.kx; next->node.ky = out.ky;
                    next->node.bound = least((double)out.cluster_bound[k], open.node.bound);
                    next->node.from = out.cluster_from[k]; next->node.width = out.cluster_width[k];
                    if (next->node.width > FULL) { next->node.from = 0; next->node.width = 1; }
                    next->offset = top; next->entries = kept;
                }
                if (out.clusters && kept > 0) top += kept;
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
