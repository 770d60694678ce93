/* A V4L2 camera at /dev/video77 for one process (LD_PRELOAD): 320x240 YUYV, stamps 10 ms apart, arrivals up to 8 ms late.

   Only `open` and `ioctl` are replaced; buffers are pages of a file in memory. Written from linux/videodev2.h. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#define WIDTH 320
#define HEIGHT 240
#define SIZE (2 * WIDTH * HEIGHT)
#define PAGES 155648 /* SIZE in whole pages */
#define BUFFERS 8
#define PERIOD_NS 10000000LL

static int camera = -1;
static unsigned char *memory;
static long long begin_ns, frame;
static int waiting[BUFFERS], count;

static long long now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

static int opened(const char *path, int flags, int mode, const char *name)
{
    int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, name);
    if (strcmp(path, "/dev/video77") != 0)
        return real(path, flags, mode);
    if (camera >= 0) /* the list of its controls is asked beside: it has none */
        return real("/dev/null", flags, mode);
    int device = memfd_create("camera", 0);
    if (ftruncate(device, BUFFERS * PAGES) != 0)
        return -1;
    memory = mmap(NULL, BUFFERS * PAGES, PROT_READ | PROT_WRITE, MAP_SHARED, device, 0);
    return camera = device;
}

#define OPEN(name) \
    int name(const char *path, int flags, ...) \
    { \
        va_list more; \
        va_start(more, flags); \
        int mode = va_arg(more, int); \
        va_end(more); \
        return opened(path, flags, mode, #name); \
    }
OPEN(open)
OPEN(open64)

static void describe(struct v4l2_buffer *buffer, int index)
{
    buffer->index = index;
    buffer->length = PAGES;
    buffer->m.offset = index * PAGES;
    buffer->bytesused = SIZE;
    buffer->memory = V4L2_MEMORY_MMAP;
}

static int next_frame(struct v4l2_buffer *buffer)
{
    if (count == 0)
        return errno = EAGAIN, -1;
    long long stamp_ns = begin_ns + PERIOD_NS * ++frame, late_ns = rand() % 8000000;
    while (now_ns() < stamp_ns + late_ns)
        usleep(200);
    describe(buffer, waiting[0]);
    memmove(waiting, waiting + 1, --count * sizeof *waiting);
    memset(memory + buffer->index * PAGES, 128, SIZE);
    buffer->timestamp.tv_sec = stamp_ns / 1000000000LL;
    buffer->timestamp.tv_usec = stamp_ns % 1000000000LL / 1000;
    buffer->flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    return 0;
}

int ioctl(int device, unsigned long request, ...)
{
    va_list more;
    va_start(more, request);
    void *given = va_arg(more, void *);
    va_end(more);
    if (device != camera || device < 0) {
        int (*real)(int, unsigned long, ...) = dlsym(RTLD_NEXT, "ioctl");
        return real(device, request, given);
    }
    switch ((unsigned int)request) {
    case VIDIOC_QUERYCAP: {
        struct v4l2_capability *able = given;
        memset(able, 0, sizeof *able);
        strcpy((char *)able->card, "emulated");
        able->capabilities = able->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
        return 0;
    }
    case VIDIOC_G_FMT:
    case VIDIOC_S_FMT:
    case VIDIOC_TRY_FMT: {
        struct v4l2_pix_format *picture = &((struct v4l2_format *)given)->fmt.pix;
        picture->width = WIDTH;
        picture->height = HEIGHT;
        picture->pixelformat = V4L2_PIX_FMT_YUYV;
        picture->field = V4L2_FIELD_NONE;
        picture->bytesperline = 2 * WIDTH;
        picture->sizeimage = SIZE;
        return 0;
    }
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM: {
        struct v4l2_fract *period = &((struct v4l2_streamparm *)given)->parm.capture.timeperframe;
        period->numerator = 1;
        period->denominator = 100;
        return 0;
    }
    case VIDIOC_REQBUFS: {
        struct v4l2_requestbuffers *asked = given;
        asked->count = asked->count < BUFFERS ? asked->count : BUFFERS;
        count = 0;
        return 0;
    }
    case VIDIOC_QUERYBUF:
        describe(given, ((struct v4l2_buffer *)given)->index);
        return 0;
    case VIDIOC_QBUF:
        waiting[count++] = ((struct v4l2_buffer *)given)->index;
        return 0;
    case VIDIOC_STREAMON:
        begin_ns = now_ns();
        return 0;
    case VIDIOC_STREAMOFF:
        count = 0;
        return 0;
    case VIDIOC_DQBUF:
        return next_frame(given);
    }
    return errno = EINVAL, -1;
}
