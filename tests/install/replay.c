/* Calls the kernels in a Windows library as a file says and writes what they return: replay LIBRARY CALL ANSWER.
   CALL: bytes of the problem, bytes of the nodes, number of arrays, whether there is a raster, and a value; the problem; the
   nodes; per array its place in the problem, its size and its contents. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <windows.h>

enum { NODE = 64, ARENA = 1 << 20, ROOM = 8192, BUDGET = 200 };

static FILE *call;

static void *take(int64_t size) {
    void *memory = calloc(1, size + 64);
    if (size && fread(memory, 1, size, call) != (size_t)size) exit(3);
    return memory;
}

int main(int count, char **arguments) {
    HMODULE library = count == 4 ? LoadLibraryA(arguments[1]) : 0;
    if (!library || !(call = fopen(arguments[2], "rb"))) return 2;
    int64_t *head = take(4 * 8);
    double value = *(double *)take(8);
    char *problem = take(head[0]), *nodes = take(head[1]);
    for (int64_t i = 0; i < head[2]; i++) {
        int64_t *array = take(2 * 8);
        *(void **)(problem + array[0]) = take(array[1]);
    }
    int64_t n = head[1] / NODE, points = *(int64_t *)problem, counts[4] = {0};
    int32_t (*version)(void) = (void *)GetProcAddress(library, "mobius_interface");
    int64_t (*work_bytes)(int64_t, int64_t) = (void *)GetProcAddress(library, "mobius_work_bytes");
    void (*raster)(void *) = (void *)GetProcAddress(library, "mobius_raster");
    void (*bounds)(void *, void *, int64_t, int32_t, void *, int64_t) = (void *)GetProcAddress(library, "mobius_bounds");
    int64_t (*expand)(void *, void *, int64_t, double, int64_t, void *, int64_t, int64_t *, void *, int64_t) =
        (void *)GetProcAddress(library, "mobius_expand");
    if (!version || !work_bytes || !raster || !bounds || !expand) return 4;
    void *work = calloc(1, work_bytes(points, ARENA)), *left = calloc(ROOM, NODE);
    if (head[3]) raster(problem);
    int64_t done = expand(problem, nodes, n, value, BUDGET, left, ROOM, counts, work, ARENA);
    bounds(problem, nodes, n, head[3] != 0, work, ARENA);
    int64_t facts[4] = {version(), done, counts[0], counts[1]};
    FILE *answer = fopen(arguments[3], "wb");
    fwrite(facts, 8, 4, answer);
    fwrite(nodes, NODE, n, answer);
    fwrite(left, NODE, counts[0], answer);
    return fclose(answer);
}
