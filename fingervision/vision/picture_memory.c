#ifdef __GLIBC__
#include <malloc.h>
#endif

/* Keep blocks of freed memory up to the given number of bytes for later use; returns whether the C library has this setting.
   */
LOOP(picture_memory_keep, "i", "b") {
#ifdef __GLIBC__
    out[0].i = mallopt(M_MMAP_THRESHOLD, (int)in[0].i) && mallopt(M_TRIM_THRESHOLD, (int)in[0].i);
#else
    out[0].i = 0;
#endif
}
