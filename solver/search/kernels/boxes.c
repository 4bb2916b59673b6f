/* Bounds of the search over Möbius transformations of the sphere: the inner loops of ../sphere_search.py.

   A transformation is a complex 2 x 2 matrix A = a0 + a1 s1 + a2 s2 + a3 s3 (Pauli's matrices) up to scale, a point of the
   sphere a unit vector psi of C^2 up to phase, its image A psi. With chi the vector of the point opposite to b, the pair
   (m, b) is matched where |chi' A psi| <= (rho / 2) |A psi|: linear in A on the left. So boxes of A, one of whose
   coefficients is 1, are bounded without any remainder but that of |A psi|; the proofs are in ../box_bounds.py, of which
   `bound_of` is the same formulas. A box hands down to its halves which source points are still undecided in it, and which
   is the heaviest pair of each that may be matched.

   Plain C with vector extensions, as kernels.c, and with the same flags: every machine computes the same numbers. */

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#define LANES 4        /* pairs looked at together */
#define PLANES 9       /* numbers of a pair: four complex coefficients, rho / 2 */
#define STACK 512      /* open boxes of one subtree: two for each halving, of six sides by 2^-38 */
#define WIDE 1.0       /* boxes that move spinors farther than that are halved without being looked at */

typedef double Four __attribute__((vector_size(32), aligned(8)));
typedef int64_t Bits __attribute__((vector_size(32), aligned(8)));

static const double SLACK = 0x1p-42;

typedef struct {
    int64_t points;         /* N1 */
    const double *source;   /* (N1, 3) */
    const double *spinors;  /* (N1, 4): psi, real and imaginary parts */
    const int64_t *start, *stop; /* row of pairs of each source point, the heaviest first; starts are multiples of LANES */
    const uint32_t *weight; /* of the pairs */
    const uint32_t *target; /* of the pairs */
    const double *caps;     /* (N2, 5): chi, real and imaginary parts, and rho / 2 */
    const double *pairs;    /* PLANES numbers of LANES pairs after another, or NULL: they are computed when they are needed */
    double most;            /* 2 h_max / (1 + h_max^2) */
    double smallest;        /* half side of boxes that are not halved */
    const volatile int32_t *halt; /* not 0: come back at once, the search is over */
} Problem;

typedef struct {
    double z[6], half[6];   /* middle and half sides: real and imaginary parts of the three coefficients that are not 1 */
    double face;            /* which is 1 */
    double largest;         /* half side */
    double bound;           /* nothing here is worth more */
} Box;                      /* followed by the blocks of pairs that need not be looked at, a byte for each of the first points */

#define COLUMNS (sizeof(Box) / sizeof(double))

typedef struct { uint32_t point, pair; } Live; /* a source point, and the heaviest of its pairs that may be matched */

typedef struct {
    double value;           /* below: of no interest */
    const Live *parents;
    int64_t count;
    int64_t settled;        /* weight of the points that one pair matches in all of the box */
    Live *children;
    int64_t left, kept;     /* settled and count for the halves */
    double slope[6];        /* what the half sides have to do with the bound */
} Query;

static const int FREE[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};

static inline double positive(double a) { return a < 0 ? -a : a; }
static inline Four all(double a) { return (Four){a, a, a, a}; }
static inline Four sizes(Four a) {
    const int64_t mask = INT64_MAX;
    return (Four)((Bits)a & (Bits){mask, mask, mask, mask});
}
static inline Four roots(Four a) {
    return (Four){__builtin_sqrt(a[0]), __builtin_sqrt(a[1]), __builtin_sqrt(a[2]), __builtin_sqrt(a[3])};
}

/* ../box_bounds.py: polar. Twice the symmetric form of A'A = k + v.s for two matrices; the form itself for one of them twice
   is half of that. */
static void polar(const double a[8], const double d[8], double *k, double v[3]) {
    *k = 0;
    for (int i = 0; i < 8; i++) *k += 2 * a[i] * d[i];
    for (int i = 0; i < 3; i++) {
        int p = 2 + 2 * ((i + 1) % 3), q = 2 + 2 * ((i + 2) % 3);
        v[i] = 2 * (a[0] * d[2 + 2 * i] + a[1] * d[3 + 2 * i] + d[0] * a[2 + 2 * i] + d[1] * a[3 + 2 * i]);
        v[i] -= 2 * (d[p] * a[q + 1] - d[q] * a[p + 1] + a[p] * d[q + 1] - a[q] * d[p + 1]);
    }
}

/* The numbers of LANES pairs from `first` on. */
static inline const double *block_of(const Problem *p, uint32_t j, int64_t first, double room[PLANES * LANES]) {
    if (p->pairs) return p->pairs + PLANES * first;
    const double *s = p->spinors + 4 * j;
    for (int k = 0; k < LANES; k++) {
        const double *c = p->caps + 5 * (size_t)p->target[first + k];
        double ur = c[0] * s[0] + c[1] * s[1], ui = c[0] * s[1] - c[1] * s[0]; /* conj(chi1) psi1 and so on */
        double vr = c[2] * s[2] + c[3] * s[3], vi = c[2] * s[3] - c[3] * s[2];
        double wr = c[0] * s[2] + c[1] * s[3], wi = c[0] * s[3] - c[1] * s[2];
        double xr = c[2] * s[0] + c[3] * s[1], xi = c[2] * s[1] - c[3] * s[0];
        double of[PLANES] = {ur + vr, ui + vi, wr + xr, wi + xi, wi - xi, xr - wr, ur - vr, ui - vi, c[4]};
        for (int i = 0; i < PLANES; i++) room[LANES * i + k] = of[i];
    }
    return room;
}

/* Q does not exceed what is returned anywhere in the box; -1: nor `value`, or no transformation is in it; -2: halted. */
static double bound_of(const Problem *p, const Box *box, Query *q) {
    double a[8] = {0}, k0, v0[3], k1[6], v1[6][3], squares[2] = {0, 0};
    const int *side = FREE[(int)box->face];
    a[2 * (int)box->face] = 1;
    for (int i = 0; i < 6; i++) a[2 * side[i / 2] + i % 2] = box->z[i];
    polar(a, a, &k0, v0);
    k0 /= 2;
    for (int i = 0; i < 3; i++) v0[i] /= 2;
    for (int i = 0; i < 6; i++) {
        double d[8] = {0};
        d[2 * side[i / 2] + i % 2] = 1;
        polar(a, d, &k1[i], v1[i]);
        squares[i % 2 != (box->face > 0 && side[i / 2] > 0)] += box->half[i] * box->half[i];
        q->slope[i] = 0;
    }
    q->kept = 0;
    q->left = q->settled;
    for (int i = 0; i < 6; i += 2) { /* |z| <= 1 */
        double x = positive(box->z[i]) - box->half[i], y = positive(box->z[i + 1]) - box->half[i + 1];
        x = x > 0 ? x : 0; y = y > 0 ? y : 0;
        if (x * x + y * y > 1 + 0x1p-40) return -1;
    }
    double length = __builtin_sqrt(v0[0] * v0[0] + v0[1] * v0[1] + v0[2] * v0[2]); /* |h| <= h_max */
    if (length > 0x1p-20) {
        double beyond = length - p->most * k0 - (1 + p->most) * (squares[0] + squares[1]);
        for (int i = 0; i < 6; i++) {
            double along = (v0[0] * v1[i][0] + v0[1] * v1[i][1] + v0[2] * v1[i][2]) / length;
            beyond -= box->half[i] * positive(along - p->most * k1[i]);
        }
        if (beyond > 0x1p-40) return -1;
    }
    int64_t total = q->settled;
    for (int64_t i = 0; i < q->count; i++) total += p->weight[q->parents[i].pair];
    if (!((double)total > q->value)) return -1;
    double move = (__builtin_sqrt(squares[0]) + __builtin_sqrt(squares[1])) * (1 + 0x1p-40);
    if (move > WIDE) {
        for (int64_t i = 0; i < q->count && q->children; i++) q->children[i] = q->parents[i];
        q->kept = q->count;
        return (double)total;
    }
    Four at[8], half[6];
    for (int i = 0; i < 8; i++) at[i] = all(a[i]);
    for (int i = 0; i < 6; i++) half[i] = all(box->half[i]);
    for (int64_t t = 0; t < q->count; t++) {
        if (*p->halt) return -2;
        uint32_t j = q->parents[t].point, first = q->parents[t].pair;
        const double *m = p->source + 3 * j;
        double square = k0 + v0[0] * m[0] + v0[1] * m[1] + v0[2] * m[2];
        double size = __builtin_sqrt(square > 0 ? square : 0), growth[6] = {0};
        double top = __builtin_sqrt((square > 0 ? square : 0) + 0x1p-44) + move;
        if (move < 0.5 * size) {
            double over = 0.5 / size;
            for (int i = 0; i < 6; i++) growth[i] = (k1[i] + v1[i][0] * m[0] + v1[i][1] * m[1] + v1[i][2] * m[2]) * over;
            top += move * move / (2 * (size - move)) - move;
        }
        int64_t found = -1, stop = p->stop[j];
        int inside = 0;
        for (int64_t b = first & ~(int64_t)(LANES - 1); b < stop && found < 0; b += LANES) {
            double room[PLANES * LANES];
            const Four *c = (const Four *)block_of(p, j, b, room);
            Four real = at[0] * c[0] - at[1] * c[1], imaginary = at[0] * c[1] + at[1] * c[0];
            for (int i = 2; i < 8; i += 2) {
                real += at[i] * c[i] - at[i + 1] * c[i + 1];
                imaginary += at[i] * c[i + 1] + at[i + 1] * c[i];
            }
            Four off = roots(real * real + imaginary * imaginary), near = off * c[8];
            Four beyond = off * (off - all(SLACK)) - near * all(top) - all(0x1p-90), part[6];
            for (int i = 0; i < 6; i += 2) {
                Four cr = c[2 * side[i / 2]], ci = c[2 * side[i / 2] + 1];
                part[i] = half[i] * sizes(real * cr + imaginary * ci - near * all(growth[i]));
                part[i + 1] = half[i + 1] * sizes(imaginary * cr - real * ci - near * all(growth[i + 1]));
            }
            for (int i = 0; i < 6; i++) beyond -= part[i];
            for (int k = b < first ? (int)(first - b) : 0; k < LANES && b + k < stop; k++) {
                if (beyond[k] > 0) continue; /* matched nowhere */
                found = b + k;
                inside = off[k] + move + SLACK <= c[8][k] * (size - move); /* matched everywhere */
                double scale = 1 / (off[k] + 0x1p-40);
                for (int i = 0; i < 6 && !inside; i++) q->slope[i] += scale * part[i][k];
                break;
            }
        }
        int64_t weight = found < 0 ? 0 : p->weight[found];
        total -= p->weight[first] - weight;
        if (!((double)total > q->value)) return -1;
        if (inside) q->left += weight;
        else if (found >= 0) {
            if (q->children) q->children[q->kept] = (Live){j, (uint32_t)found};
            q->kept++;
        }
    }
    return (double)total;
}

/* All source points with the first of their pairs, but for those that are dead by `skipped`. */
static int64_t everything(const Problem *p, const uint8_t *skipped, int64_t known, Live *list) {
    int64_t count = 0;
    for (int64_t j = 0; j < p->points; j++) {
        int64_t first = p->start[j] + (j < known ? LANES * (int64_t)skipped[j] : 0);
        if (first < p->stop[j]) list[count++] = (Live){(uint32_t)j, (uint32_t)first};
    }
    return count;
}

/* Put a box and what is known of its list among those left; of points that are in no list, what was known before. */
static void leave(const Problem *p, const Box *box, const Live *list, int64_t count, const uint8_t *before, int64_t known,
                  double *left) {
    uint8_t *skipped = (uint8_t *)(left + COLUMNS);
    __builtin_memcpy(left, box, sizeof(Box));
    for (int64_t j = 0; j < known; j++) skipped[j] = before[j];
    for (int64_t i = 0; i < count && list[i].point < known; i++) {
        int64_t blocks = (list[i].pair - p->start[list[i].point]) / LANES;
        skipped[list[i].point] = blocks < 255 ? (uint8_t)blocks : 255;
    }
}

/* Write the bound of each box into it, -1 where it is not above `value` or no transformation is in the box. `arena`: N1
   entries. */
EXPORT void boxes_bounds(const Problem *p, Box *boxes, int64_t n, double value, Live *arena) {
    int64_t count = everything(p, 0, 0, arena);
    for (int64_t i = 0; i < n; i++) {
        Query query = {value, arena, count, 0, 0, 0, 0, {0}};
        boxes[i].bound = bound_of(p, &boxes[i], &query);
    }
}

static void halve(const Box *box, const double slope[6], Box halves[2]) {
    int best = 0;
    for (int i = 1; i < 6; i++)
        if (slope[i] > slope[best] || (slope[i] == slope[best] && box->half[i] > box->half[best])) best = i;
    if (!(box->half[best] > 0x1p-6 * box->largest)) /* none is forgotten */
        for (int i = 0; i < 6; i++) if (box->half[i] > box->half[best]) best = i;
    for (int s = 0; s < 2; s++) {
        Box *half = &halves[s];
        *half = *box;
        half->half[best] /= 2;
        half->z[best] += s ? half->half[best] : -half->half[best];
        half->largest = 0;
        for (int i = 0; i < 6; i++) if (half->half[i] > half->largest) half->largest = half->half[i];
    }
}

typedef struct { Box box; int64_t offset, count, settled; } Open; /* list of points and pairs */

/* Search the subtrees of `boxes` depth first for boxes whose bound exceeds `value`, at most `budget` bounds each; what is left
   open goes to `left`, and so do those whose bound is at most `enough`. `stride`: numbers from one box to the next. Returns how
   many of `boxes` were taken on (all, unless `left` might overflow, or halted). counts: boxes left, bounds computed. */
EXPORT int64_t boxes_expand(const Problem *p, const double *boxes, int64_t n, int64_t stride, double value, double enough,
                            int64_t budget, double *left, int64_t left_room, int64_t *counts, Live *arena, int64_t room) {
    Open stack[STACK];
    int64_t done = 0, bounds = 0, found = 0, known = (stride - (int64_t)COLUMNS) * (int64_t)sizeof(double);
    if (known > p->points) known = p->points;
    for (; done < n && found + budget + STACK <= left_room && !*p->halt; done++) {
        const uint8_t *before = (const uint8_t *)(boxes + stride * done + COLUMNS);
        int64_t depth = 1, spent = 0;
        __builtin_memcpy(&stack[0].box, boxes + stride * done, sizeof(Box));
        stack[0].offset = stack[0].settled = 0;
        stack[0].count = everything(p, before, known, arena);
        while (depth) {
            Open open = stack[--depth];
            int64_t top = open.offset + open.count;
            int over = spent >= budget || top + open.count > room || *p->halt;
            Query query = {value, arena + open.offset, open.count, open.settled, arena + top, 0, 0, {0}};
            double bound = over ? -2 : bound_of(p, &open.box, &query);
            if (bound == -2) {
                leave(p, &open.box, arena + open.offset, open.count, before, known, left + stride * found++);
                continue;
            }
            bounds++; spent++;
            if (bound < 0) continue;
            if (bound < open.box.bound) open.box.bound = bound;
            if (open.box.bound <= enough || open.box.largest <= p->smallest || depth + 2 > STACK) {
                leave(p, &open.box, arena + top, query.kept, before, known, left + stride * found++);
                continue;
            }
            Box halves[2];
            halve(&open.box, query.slope, halves);
            for (int s = 0; s < 2; s++) stack[depth++] = (Open){halves[s], top, query.kept, query.left};
        }
    }
    counts[0] = found; counts[1] = bounds;
    return done;
}
