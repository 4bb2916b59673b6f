/* The inner loops of the search on the sphere: kernels.c once more, with caps for discs. */

#define SPHERE
#include "kernels.c"
