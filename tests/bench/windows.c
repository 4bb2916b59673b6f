/* Bounds and expansions by the Windows library, for windows.py: reads one problem and nodes from a file, writes the nodes.

   usage: windows.exe LIBRARY IN OUT
   IN, in words of eight bytes: words of the problem; the problem; number of arrays; for each its word in the problem, its
   bytes and these; bytes of working memory; arena; value; number of nodes; nodes. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <windows.h>

typedef void (*Bounds)(const void *, double *, int64_t, int32_t, void *, int64_t);
typedef int64_t (*Expand)(const void *, const double *, int64_t, double, int64_t, double *, int64_t, int64_t *, void *, int64_t);

static FILE *in;
static int64_t number(void) { int64_t n; if (fread(&n, 8, 1, in) != 1) exit(3); return n; }
static void *bytes(int64_t n) { void *p = malloc((size_t)n + 64); if (n && fread(p, 1, (size_t)n, in) != (size_t)n) exit(4); return p; }

int main(int count, char **names) {
    if (count != 4 || !(in = fopen(names[2], "rb"))) return 2;
    HMODULE library = LoadLibraryA(names[1]);
    if (!library) return 5;
    Bounds bounds = (Bounds)(void *)GetProcAddress(library, "mobius_bounds");
    Expand expand = (Expand)(void *)GetProcAddress(library, "mobius_expand");
    if (!bounds || !expand) return 6;
    int64_t *problem = bytes(8 * number());
    for (int64_t arrays = number(); arrays; arrays--) {
        int64_t word = number();
        problem[word] = (int64_t)(intptr_t)bytes(number());
    }
    void *memory = malloc((size_t)number());
    int64_t arena = number(), room = 4096, counts[4];
    double *value = bytes(8);
    int64_t n = number();
    double *nodes = bytes(64 * n), *left = calloc((size_t)room, 64);
    expand(problem, nodes, 1, *value, 400, left, room, counts, memory, arena);
    bounds(problem, nodes, n, 1, memory, arena);
    FILE *out = fopen(names[3], "wb");
    fwrite(nodes, 64, (size_t)n, out);
    fwrite(left, 64, (size_t)counts[0], out);
    return fclose(out);
}
