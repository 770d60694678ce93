#ifdef __GLIBC__
#include <malloc.h>
#endif

/* Keep freed memory of up to so many bytes for what comes next; whether the C library does so. */
LOOP(picture_memory_keep, "i", "b") {
#ifdef __GLIBC__
    out[0].i = mallopt(M_MMAP_THRESHOLD, (int)in[0].i) && mallopt(M_TRIM_THRESHOLD, (int)in[0].i);
#else
    out[0].i = 0;
#endif
}
