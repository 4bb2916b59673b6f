/* Pictures carried from surface to surface: the inner loops of ../../carry/textures.

   What they compute is told, and done again in numpy, in ../../carry/textures/reference.py. Compiled into the same
   library as kernels.c, with the same flags. */

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#define INTERFACE 2
#define STEPS 4096    /* of one walk */
#define INSIDE 1e-9   /* how far outside a face counts as in it, in barycentric coordinates */
#define DEPTH 0.01    /* texels: islands that overlap by less only touch */
#define TRACE 0.25    /* of a byte: how much a texel counts that cannot be seen */

typedef struct {
    int32_t triangle, face;
    float corner[2];    /* barycentric coordinates 1 and 2 in the target's triangle */
    float place[2];     /* the same in the source's face */
    float across[2], down[2]; /* how these change to the next texel of a row, and to the next row */
} Texel;

typedef struct {
    int64_t triangles;
    const double *layout;   /* (m, 3, 2) in texels: the middle of the first one is (0, 0) */
    const int32_t *vertex;  /* (m, 3) */
    const double *place;    /* (n, 3), of each target vertex on the source */
    const double *normal;   /* (n, 3), there */
    const int32_t *at;      /* (n,), the source's face there; -1: no counterpart */
    const double *source;   /* (s, 3) */
    const int32_t *faces;   /* (f, 3) */
    const int32_t *beyond;  /* (f, 3): the face across the side opposite each corner, -1: none */
} Carrying;

typedef struct {
    int64_t width, height, channels;
    const uint8_t *bytes;   /* NULL: floats */
    const float *floats;
    const float *table;     /* what each byte of each channel stands for, (channels, 256) */
    const uint8_t *opaque;  /* (height, width), how much each texel counts; NULL: all the same */
    const uint16_t *label;  /* (height, width), 0: no island; NULL: any texel may be read */
    int64_t wrap;           /* beyond the edge: 0 again from the other side, 1 the edge, 2 nothing, 3 again mirrored */
} Picture;

EXPORT int64_t mobius_texels_interface(void) { return INTERFACE; }

static inline double least(double a, double b) { return a < b ? a : b; }
static inline double most(double a, double b) { return a > b ? a : b; }

static inline void cross(const double *a, const double *b, double *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* A triangle of a layout, and the linear functions that are its barycentric coordinates. */
typedef struct { double x[3], y[3], gx[3], gy[3], at[3], reach[3], depth[3]; int64_t left, right, top, bottom; } Flat;

/* Returns 0 for a triangle without area. `reach`: by how much a coordinate may fall below 0 where the texel still
   touches the triangle; `depth`: by how much it rises within DEPTH. */
static int flat(const double *corner, Flat *t) {
    for (int k = 0; k < 3; k++) { t->x[k] = corner[2 * k]; t->y[k] = corner[2 * k + 1]; }
    double area = (t->x[1] - t->x[0]) * (t->y[2] - t->y[0]) - (t->x[2] - t->x[0]) * (t->y[1] - t->y[0]);
    if (!(area > 1e-12 || area < -1e-12)) return 0;
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        t->gx[k] = (t->y[i] - t->y[j]) / area;
        t->gy[k] = (t->x[j] - t->x[i]) / area;
        t->at[k] = (t->x[i] * t->y[j] - t->x[j] * t->y[i]) / area;
        t->reach[k] = 0.5 * (fabs(t->gx[k]) + fabs(t->gy[k]));
        t->depth[k] = DEPTH * sqrt(t->gx[k] * t->gx[k] + t->gy[k] * t->gy[k]);
    }
    t->left = (int64_t)ceil(least(t->x[0], least(t->x[1], t->x[2])) - 0.5);
    t->right = (int64_t)floor(most(t->x[0], most(t->x[1], t->x[2])) + 0.5);
    t->top = (int64_t)ceil(least(t->y[0], least(t->y[1], t->y[2])) - 0.5);
    t->bottom = (int64_t)floor(most(t->y[0], most(t->y[1], t->y[2])) + 0.5);
    return 1;
}

/* Coordinates of a texel's middle; returns 2: in the triangle, 1: the texel touches it, 0: neither. */
static inline int touches(const Flat *t, double x, double y, double *w) {
    int inside = 1;
    for (int k = 0; k < 3; k++) {
        w[k] = t->at[k] + t->gx[k] * x + t->gy[k] * y;
        if (w[k] < -t->reach[k]) return 0;
        inside &= w[k] >= 0;
    }
    return 1 + inside;
}

/* Coordinates of the triangle's point nearest to (x, y), and its squared distance. */
static double nearest(const Flat *t, double x, double y, double *w) {
    double best = INFINITY;
    for (int k = 0; k < 3; k++) {
        int j = (k + 1) % 3;
        double sx = t->x[j] - t->x[k], sy = t->y[j] - t->y[k], length = sx * sx + sy * sy;
        double s = length > 0 ? ((x - t->x[k]) * sx + (y - t->y[k]) * sy) / length : 0;
        s = least(most(s, 0), 1);
        double dx = t->x[k] + s * sx - x, dy = t->y[k] + s * sy - y, square = dx * dx + dy * dy;
        if (square < best) { best = square; w[k] = 1 - s; w[j] = s; w[(k + 2) % 3] = 0; }
    }
    return best;
}

/* Walks over the source's faces to the one that the line through p along n meets; returns how far outside of `face`,
   in barycentric coordinates, that is in the end. */
static double walk(const Carrying *c, int32_t start, const double *p, const double *n, int32_t *face, double *b) {
    int32_t here = start, before = -1;
    double outside = INFINITY;
    for (int step = 0; step < STEPS; step++) {
        const int32_t *f = c->faces + 3 * (int64_t)here;
        double r[3][3], v[3], e[3];
        for (int k = 0; k < 3; k++)
            for (int d = 0; d < 3; d++) r[k][d] = c->source[3 * (int64_t)f[k] + d] - p[d];
        for (int k = 0; k < 3; k++) { cross(r[(k + 1) % 3], r[(k + 2) % 3], v); e[k] = dot(n, v); }
        double total = e[0] + e[1] + e[2];
        double low = least(e[0], least(e[1], e[2]));
        double beside = total > 0 ? most(-low / total, 0) : INFINITY;
        if (beside < outside || step == 0) {
            outside = beside;
            *face = here;
            for (int k = 0; k < 3; k++) b[k] = total > 0 ? e[k] / total : 1.0 / 3;
        }
        if (beside <= INSIDE) break;
        int32_t next = -1;
        double lowest = 0;
        const int32_t *around = c->beyond + 3 * (int64_t)here;
        for (int k = 0; k < 3; k++)
            if (around[k] >= 0 && around[k] != before && e[k] < lowest) { lowest = e[k]; next = around[k]; }
        if (next < 0) break;
        before = here;
        here = next;
    }
    double sum = 0;
    for (int k = 0; k < 3; k++) { b[k] = most(b[k], 0); sum += b[k]; }
    for (int k = 0; k < 3; k++) b[k] /= sum;
    return outside;
}

/* Squared distance from p to a face of the source, and the coordinates of its nearest point. */
static double apart_from(const Carrying *c, int32_t face, const double *p, double *b) {
    const int32_t *f = c->faces + 3 * (int64_t)face;
    double e[2][3], q[3], r[3];
    for (int d = 0; d < 3; d++) {
        double first = c->source[3 * (int64_t)f[0] + d];
        for (int k = 0; k < 2; k++) e[k][d] = c->source[3 * (int64_t)f[k + 1] + d] - first;
        q[d] = p[d] - first;
    }
    double uu = dot(e[0], e[0]), uv = dot(e[0], e[1]), vv = dot(e[1], e[1]), qu = dot(q, e[0]), qv = dot(q, e[1]);
    double square = uu * vv - uv * uv;
    b[1] = (vv * qu - uv * qv) / square;
    b[2] = (uu * qv - uv * qu) / square;
    b[0] = 1 - b[1] - b[2];
    if (!(square > 0 && b[0] >= 0 && b[1] >= 0 && b[2] >= 0)) {
        double best = INFINITY;
        for (int k = 0; k < 3; k++) {
            int j = (k + 1) % 3;
            double side[3], from[3], length = 0;
            for (int d = 0; d < 3; d++) {
                double start = c->source[3 * (int64_t)f[k] + d];
                side[d] = c->source[3 * (int64_t)f[j] + d] - start;
                from[d] = p[d] - start;
            }
            length = dot(side, side);
            double s = length > 0 ? least(most(dot(from, side) / length, 0), 1) : 0;
            for (int d = 0; d < 3; d++) r[d] = from[d] - s * side[d];
            if (dot(r, r) < best) { best = dot(r, r); b[k] = 1 - s; b[j] = s; b[(k + 2) % 3] = 0; }
        }
        return best;
    }
    for (int d = 0; d < 3; d++) r[d] = q[d] - b[1] * e[0][d] - b[2] * e[1][d];
    return dot(r, r);
}

/* Goes from a face to ever nearer ones among the neighbours and theirs; returns the squared distance. */
static double descend(const Carrying *c, int32_t start, const double *p, int32_t *face, double *b) {
    double best = apart_from(c, start, p, b);
    *face = start;
    for (int step = 0; step < STEPS; step++) {
        int32_t here = *face;
        const int32_t *around = c->beyond + 3 * (int64_t)here;
        for (int k = 0; k < 3; k++) {
            if (around[k] < 0) continue;
            for (int j = -1; j < 3; j++) {
                int32_t next = j < 0 ? around[k] : c->beyond[3 * (int64_t)around[k] + j];
                double there[3];
                if (next < 0 || next == here) continue;
                double its = apart_from(c, next, p, there);
                if (its < best) { best = its; *face = next; for (int d = 0; d < 3; d++) b[d] = there[d]; }
            }
        }
        if (*face == here) break;
    }
    return best;
}

/* Whether a place on a face is farther from p than the farthest of the places that p lies between. */
static int astray(const Carrying *c, int32_t face, const double *b, const double *p, const int32_t *v) {
    double reach = 0, off = 0;
    for (int k = 0; k < 3; k++) {
        double square = 0;
        for (int d = 0; d < 3; d++) {
            double x = c->place[3 * (int64_t)v[k] + d] - p[d];
            square += x * x;
        }
        reach = most(reach, square);
    }
    for (int d = 0; d < 3; d++) {
        double x = -p[d];
        for (int k = 0; k < 3; k++) x += b[k] * c->source[3 * (int64_t)c->faces[3 * (int64_t)face + k] + d];
        off += x * x;
    }
    return off > reach;
}

/* Finds for each texel of some rows the target's triangle, and the source's face. `texel` has triangle -1 everywhere,
   `apart` is working memory, both (rows, width). Returns the number of texels in which triangles overlap. */
EXPORT int64_t mobius_texels(const Carrying *c, int64_t first, int64_t rows, int64_t width, Texel *texel, double *apart) {
    int64_t overlaps = 0;
    for (int64_t k = 0; k < c->triangles; k++) {
        Flat t;
        const double *corner = c->layout + 6 * k;
        double low = least(corner[1], least(corner[3], corner[5])), high = most(corner[1], most(corner[3], corner[5]));
        if (!(high >= first - 1 && low <= first + rows) || !flat(corner, &t)) continue;
        int64_t left = t.left < 0 ? 0 : t.left, right = t.right >= width ? width - 1 : t.right;
        int64_t top = t.top < first ? first : t.top, bottom = t.bottom >= first + rows ? first + rows - 1 : t.bottom;
        for (int64_t y = top; y <= bottom; y++) {
            for (int64_t x = left; x <= right; x++) {
                double w[3], square = 0;
                int how = touches(&t, (double)x, (double)y, w);
                if (!how) continue;
                int64_t i = (y - first) * width + x;
                Texel *own = texel + i;
                if (how == 2) {
                    if (own->triangle >= 0 && apart[i] == 0) {
                        overlaps += w[0] > t.depth[0] && w[1] > t.depth[1] && w[2] > t.depth[2];
                        continue;
                    }
                } else {
                    if (own->triangle >= 0 && apart[i] == 0) continue;
                    square = nearest(&t, (double)x, (double)y, w);
                    if (own->triangle >= 0 && square >= apart[i]) continue;
                }
                apart[i] = square;
                own->triangle = (int32_t)k;
                own->corner[0] = (float)w[1];
                own->corner[1] = (float)w[2];
            }
        }
    }
    int32_t triangle = -1, face = -1;
    double along[3] = {0, 0, 0}, below[3] = {0, 0, 0};
    for (int64_t i = 0; i < rows * width; i++) {
        Texel *own = texel + i;
        if (own->triangle < 0) continue;
        const int32_t *v = c->vertex + 3 * (int64_t)own->triangle;
        if (c->at[v[0]] < 0 || c->at[v[1]] < 0 || c->at[v[2]] < 0) continue;
        if (own->triangle != triangle) {
            Flat t;
            triangle = own->triangle;
            face = -1;
            if (!flat(c->layout + 6 * (int64_t)triangle, &t)) continue;
            for (int d = 0; d < 3; d++) {
                along[d] = below[d] = 0;
                for (int k = 0; k < 3; k++) {
                    along[d] += t.gx[k] * c->place[3 * (int64_t)v[k] + d];
                    below[d] += t.gy[k] * c->place[3 * (int64_t)v[k] + d];
                }
            }
        }
        double w[3] = {1 - (double)own->corner[0] - own->corner[1], own->corner[0], own->corner[1]};
        double p[3] = {0, 0, 0}, n[3] = {0, 0, 0}, b[3] = {0, 0, 0};
        int k0 = w[0] >= w[1] && w[0] >= w[2] ? 0 : w[1] >= w[2] ? 1 : 2;
        for (int k = 0; k < 3; k++)
            for (int d = 0; d < 3; d++) {
                p[d] += w[k] * c->place[3 * (int64_t)v[k] + d];
                n[d] += w[k] * c->normal[3 * (int64_t)v[k] + d];
            }
        int32_t found = -1;
        double outside = walk(c, face >= 0 ? face : c->at[v[k0]], p, n, &found, b);
        for (int k = 0; k < 3 && outside > INSIDE; k++) {
            int32_t other = -1;
            double there[3];
            double its = walk(c, c->at[v[k]], p, n, &other, there);
            if (its < outside) { outside = its; found = other; for (int d = 0; d < 3; d++) b[d] = there[d]; }
        }
        if (outside > INSIDE || astray(c, found, b, p, v)) {
            double best = INFINITY;
            outside = INFINITY;
            for (int k = 0; k < 3; k++) {
                int32_t other = -1;
                double there[3], its = descend(c, c->at[v[k]], p, &other, there);
                if (its < best) { best = its; found = other; for (int d = 0; d < 3; d++) b[d] = there[d]; }
            }
        }
        own->face = found;
        face = outside <= INSIDE ? found : -1;
        own->place[0] = (float)b[1];
        own->place[1] = (float)b[2];
        const int32_t *f = c->faces + 3 * (int64_t)found;
        double side[3][3], slope[3][3], turned[3];
        for (int k = 0; k < 3; k++)
            for (int d = 0; d < 3; d++)
                side[k][d] = c->source[3 * (int64_t)f[(k + 1) % 3] + d] - c->source[3 * (int64_t)f[(k + 2) % 3] + d];
        for (int k = 0; k < 3; k++) cross(side[k], n, slope[k]);
        cross(side[1], side[2], turned);
        double total = dot(n, turned);
        if (!(total > 0)) continue;
        for (int k = 0; k < 2; k++) {
            own->across[k] = (float)(dot(along, slope[k + 1]) / total);
            own->down[k] = (float)(dot(below, slope[k + 1]) / total);
        }
    }
    return overlaps;
}

static inline int64_t wrapped(int64_t i, int64_t size, int64_t wrap) {
    if (i >= 0 && i < size) return i;
    if (wrap == 2) return -1;
    if (wrap == 1) return i < 0 ? 0 : size - 1;
    int64_t period = wrap == 3 ? 2 * size : size;
    i %= period;
    if (i < 0) i += period;
    return i < size ? i : period - 1 - i;
}

/* What a value between two bytes stands for. */
static inline double decoded(const float *table, double byte) {
    int64_t low = (int64_t)byte;
    if (low > 254) return table[255];
    return table[low] + (byte - low) * (table[low + 1] - table[low]);
}

/* Adds the bilinear value at (x, y), in texels, from texels of one island alone; `own` 0: of any. Between bytes it is
   taken before they are decoded. Returns the share of the weight that counted. */
static inline double bilinear(const Picture *p, double x, double y, uint16_t own, double *sum) {
    double fx = floor(x), fy = floor(y), sx = x - fx, sy = y - fy, counted = 0;
    double value[4] = {0, 0, 0, 0};
    for (int j = 0; j < 2; j++) {
        double wy = j ? sy : 1 - sy;
        if (wy <= 0) continue;
        int64_t row = wrapped((int64_t)fy + j, p->height, p->wrap);
        for (int i = 0; i < 2; i++) {
            double w = wy * (i ? sx : 1 - sx);
            if (w <= 0) continue;
            int64_t column = wrapped((int64_t)fx + i, p->width, p->wrap);
            if (row < 0 || column < 0) { if (!own) counted += w; continue; }
            int64_t at = row * p->width + column;
            if (own && p->label[at] != own) continue;
            if (p->opaque) w *= (p->opaque[at] + TRACE) / 255;
            counted += w;
            if (p->bytes)
                for (int64_t k = 0; k < p->channels; k++) value[k] += w * p->bytes[at * p->channels + k];
            else
                for (int64_t k = 0; k < p->channels; k++) value[k] += w * p->floats[at * p->channels + k];
        }
    }
    if (counted <= 0) return 0;
    for (int64_t k = 0; k < p->channels; k++) {
        double mean = value[k] / counted;
        sum[k] += counted * (p->bytes ? decoded(p->table + 256 * k, mean) : mean);
    }
    return counted;
}

/* How many points the mean over a side of a texel takes, from its length squared. */
static inline int64_t parts(double square, int64_t limit) {
    double n = ceil(sqrt(most(square - 1, 0)));
    return n < 1 ? 1 : n > limit ? limit : (int64_t)n;
}

/* Writes the mean of the picture over each of some texels whose face is on the wanted page: (n, channels). `corner`:
   (f, 3, 2), where the faces lie in the picture, in texels; `island`: (f,), whose texels they may read. */
EXPORT void mobius_sample(const Picture *p, int64_t n, const Texel *texel, const double *corner, const int32_t *page,
                          int64_t wanted, const uint16_t *island, int64_t limit, float *out) {
    for (int64_t i = 0; i < n; i++) {
        const Texel *t = texel + i;
        if (t->face < 0 || page[t->face] != wanted) continue;
        const double *c = corner + 6 * (int64_t)t->face;
        double ux = c[2] - c[0], uy = c[3] - c[1], vx = c[4] - c[0], vy = c[5] - c[1];
        double x = c[0] + t->place[0] * ux + t->place[1] * vx, y = c[1] + t->place[0] * uy + t->place[1] * vy;
        double ax = t->across[0] * ux + t->across[1] * vx, ay = t->across[0] * uy + t->across[1] * vy;
        double bx = t->down[0] * ux + t->down[1] * vx, by = t->down[0] * uy + t->down[1] * vy;
        int64_t na = parts(ax * ax + ay * ay, limit), nb = parts(bx * bx + by * by, limit);
        uint16_t own = p->label ? island[t->face] : 0;
        double sum[4] = {0, 0, 0, 0}, total = 0;
        for (int64_t j = 0; j < nb; j++)
            for (int64_t k = 0; k < na; k++) {
                double s = (k + 0.5) / na - 0.5, r = (j + 0.5) / nb - 0.5;
                total += bilinear(p, x + s * ax + r * bx, y + s * ay + r * by, own, sum);
            }
        if (!(total > 0)) { total = bilinear(p, x, y, 0, sum); }
        for (int64_t k = 0; k < p->channels; k++) out[i * p->channels + k] = (float)(sum[k] / total);
    }
}

static uint16_t root(const uint16_t *parent, uint16_t i) {
    while (parent[i] != i) i = parent[i];
    return i;
}

/* Labels the texels of a picture whose middle is in an island of a layout. Islands that overlap become one in
   `parent`, (65536,). */
EXPORT void mobius_islands(int64_t faces, const double *corner, const int32_t *page, int64_t wanted,
                           const uint16_t *island, int64_t width, int64_t height, int64_t wrap, uint16_t *label,
                           uint16_t *parent) {
    for (int64_t k = 0; k < faces; k++) {
        Flat t;
        if (page[k] != wanted || !flat(corner + 6 * k, &t)) continue;
        if (t.right - t.left > 2 * width || t.bottom - t.top > 2 * height) continue;
        for (int64_t y = t.top; y <= t.bottom; y++) {
            int64_t row = wrapped(y, height, wrap == 1 ? 2 : wrap);
            if (row < 0) continue;
            for (int64_t x = t.left; x <= t.right; x++) {
                double w[3];
                if (touches(&t, (double)x, (double)y, w) != 2) continue;
                int64_t column = wrapped(x, width, wrap == 1 ? 2 : wrap);
                if (column < 0) continue;
                uint16_t *own = label + row * width + column;
                if (!*own) *own = island[k];
                else if (*own != island[k] && w[0] > t.depth[0] && w[1] > t.depth[1] && w[2] > t.depth[2]) {
                    uint16_t a = root(parent, *own), b = root(parent, island[k]);
                    if (a < b) parent[b] = a;
                    else parent[a] = b;
                }
            }
        }
    }
}
