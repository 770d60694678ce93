/* What every loop in C is written with: its arguments, and a few words of arithmetic.

   A loop is a function on arrays that Python would go through too slowly. It stands in a .c file beside the .py file that
   calls it, takes that file's constants (NAMES IN CAPITALS) from there, and is announced by LOOP(name, takes, gives).

   takes, a letter an argument:
     d float          F float64 array        p picture: uint8 or uint16, two-dimensional, any strides
     i int            I int64 array          P picture that is written to
                      B bool or uint8 array  f, j, b, s as F, I, B, S: written to
                      O int32 array          S float32 array
   gives, a letter a number that comes back: d float, i int, b bool. Arrays are contiguous, and made by the caller.

   Sums are taken in the order in which they stand: the same digits on every machine. */

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    double d;           /* a float */
    int64_t i;          /* an int */
    void *data;         /* first element of an array */
    int64_t n;          /* elements in all */
    int64_t shape[3];   /* along each axis; 1 beyond the last */
    int64_t stride[2];  /* bytes from row to row and from column to column, of a picture */
    int bytes;          /* an element has */
} Arg;

typedef union {
    double d;
    int64_t i;
} Value;

#define LOOP(name, takes, gives) static void name(const Arg *in, Value *out)
/* What is made once, when the library is loaded. */
#define PREPARE(name) static void name(void)
#define FLOATS(k) ((double *)in[k].data)
#define INTS(k) ((int64_t *)in[k].data)
#define FLAGS(k) ((uint8_t *)in[k].data)
#define POINTS(k) ((const int32_t *)in[k].data)

/* A function in a version for every width of vector registers, of which the widest that the processor has is chosen when the
   library is loaded. Vectorised results have the same digits as scalar ones. */
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define SIDE_BY_SIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define SIDE_BY_SIDE
#endif

static const double PI = 3.14159265358979323846;

/* Python's max and min. */
static inline double larger(double a, double b) { return b > a ? b : a; }
static inline double smaller(double a, double b) { return b < a ? b : a; }
static inline int64_t larger_int(int64_t a, int64_t b) { return b > a ? b : a; }
static inline int64_t smaller_int(int64_t a, int64_t b) { return b < a ? b : a; }
static inline double within(double a, double low, double high) { return smaller(larger(a, low), high); }
static inline double square(double a) { return a * a; }

/* One pixel of a picture. */
static inline int64_t pixel(const Arg *picture, int64_t row, int64_t column) {
    const char *at = (const char *)picture->data + row * picture->stride[0] + column * picture->stride[1];
    return picture->bytes == 1 ? *(const uint8_t *)at : *(const uint16_t *)at;
}

/* Room for so many elements; free() gives it back. Where a few kilobytes are not to be had, nothing can go on. */
static void *room(int64_t count, size_t bytes) {
    void *found = malloc((size_t)(count > 0 ? count : 1) * bytes);
    if (!found) abort();
    return found;
}
static inline double *floats(int64_t count) { return (double *)room(count, sizeof(double)); }
static inline int64_t *ints(int64_t count) { return (int64_t *)room(count, sizeof(int64_t)); }
