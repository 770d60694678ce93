/* An ATmega328P that runs a sketch in step with the wall clock, its serial line on a pseudo-terminal.

   Its time stands while a byte is under way on the serial line, in either direction, or a line on stdout is unread: a
   computer that is busy with other work does not fall behind the board. (The kernel carries bytes from one end of a
   pseudo-terminal to the other when it finds the time, and neither end can ask for them: both count.)

   avrhost SKETCH.elf SLOWER SHARED: SLOWER is how many times slower than the wall clock, SHARED a file of five numbers of
   8 bytes: the cycle, the bytes that went out and came in here, and those that the computer has read and written
   (greater than all: it has hung up). Then on stdin, one command a line:
       pin N LEVEL      what stands outside at Arduino pin N         adc CHANNEL MILLIVOLT
       spoil OUT IN     flip a bit in every OUT-th byte to the computer, every IN-th to the board (0: none)
       reset            what the reset button does                    unplug     pull the cable
   and on stdout:
       pty PATH   port LETTER PORT DDR CYCLE   (a port's registers, hexadecimal, at each change)
       done CYCLE                              (a command) */
#define _GNU_SOURCE
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>

enum { HERTZ = 16000000, PACE_CYCLES = HERTZ / 4000, LEAST_SLEEP_NS = 100000, MOST_HURRY_NS = 2000000 };
/* How often it looks whether it was heard, and how long it waits for a reader before it holds that there is none. */
enum { LOOK_NS = 100000, LISTENER_WITHIN_NS = 2000000000 };

static avr_t *avr;
static int line = -1, keeper = -1; /* keeper holds the slave open, so that a closing client is no pulled cable */
static unsigned spoil_out, spoil_in, sent, taken, may_send = 1;
static int reset_wanted;
enum { CYCLE, OUT, IN, READ, WRITTEN, SHARED };
static volatile uint64_t *shared;
static int64_t start_ns, soonest_ns, slower;
static struct { unsigned port, ddr; } ports[3];

static int64_t now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

static void on_port(avr_irq_t *irq, uint32_t value, void *param) {
    intptr_t what = (intptr_t)param;
    unsigned *known = what & 1 ? &ports[what >> 1].ddr : &ports[what >> 1].port;
    (void)irq;
    if (*known == value) return;
    *known = value;
    printf("port %c %02X %02X %llu\n", "BCD"[what >> 1], ports[what >> 1].port, ports[what >> 1].ddr,
           (unsigned long long)avr->cycle);
}

static void on_byte(avr_irq_t *irq, uint32_t value, void *param) {
    uint8_t byte = value;
    (void)irq, (void)param;
    shared[CYCLE] = avr->cycle;
    if (spoil_out && ++sent % spoil_out == 0) byte ^= 1 << sent / spoil_out % 7;
    if (line >= 0 && write(line, &byte, 1) == 1) shared[OUT]++; /* else nobody reads: lost, as on a real line */
}

static void on_flow(avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)value;
    may_send = param != NULL;
}

static avr_irq_t *pin_irq(unsigned pin) {
    char port = pin < 8 ? 'D' : pin < 14 ? 'B' : 'C';
    return avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), pin < 8 ? pin : pin < 14 ? pin - 8 : pin - 14);
}

static void obey(const char *words) {
    unsigned a, b;
    if (sscanf(words, "pin %u %u", &a, &b) == 2) avr_raise_irq(pin_irq(a), b);
    else if (sscanf(words, "adc %u %u", &a, &b) == 2)
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + a), b);
    else if (sscanf(words, "spoil %u %u", &a, &b) == 2) spoil_out = a, spoil_in = b;
    else if (!strncmp(words, "reset", 5)) reset_wanted = 1;
    else if (!strncmp(words, "unplug", 6)) close(keeper), close(line), line = -1;
}

static void listen_outside(void) {
    static char words[256];
    static size_t length;
    struct pollfd waiting = {STDIN_FILENO, POLLIN, 0};
    while (poll(&waiting, 1, 0) > 0) {
        if (read(STDIN_FILENO, words + length, 1) != 1) exit(0);
        if (words[length] == '\n') {
            words[length] = 0, length = 0, obey(words);
            printf("done %llu\n", (unsigned long long)avr->cycle);
        }
        else if (length < sizeof words - 2) length++;
    }
}

static void feed_serial(void) {
    static avr_irq_t *input;
    if (!input) input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    uint8_t byte;
    while (line >= 0 && may_send && read(line, &byte, 1) == 1) {
        shared[IN]++;
        if (spoil_in && ++taken % spoil_in == 0) byte ^= 1 << taken / spoil_in % 7;
        avr_raise_irq(input, byte);
    }
}

static int under_way(void) {
    int arrived = 0, on_stdout = 0;
    ioctl(STDOUT_FILENO, FIONREAD, &on_stdout);
    if (line < 0 || on_stdout) return on_stdout;
    ioctl(line, FIONREAD, &arrived);
    return shared[READ] < shared[OUT] || (int64_t)(shared[WRITTEN] - shared[IN]) > arrived;
}

/* The wall clock's time that was spent until nothing was under way. */
static int64_t waited_ns(void) {
    static int nobody_reads;
    struct timespec look = {0, LOOK_NS};
    int64_t since = now_ns();
    if (!under_way()) return nobody_reads = 0;
    while (!nobody_reads && under_way()) {
        nanosleep(&look, NULL);
        listen_outside();
        nobody_reads = now_ns() - since > LISTENER_WITHIN_NS;
    }
    return now_ns() - since;
}

/* In step with the wall clock, with an ear to the outside; after a hold-up at most twice as fast, so that the computer
   keeps up with the board. It is a timer of the emulated chip, since a sleeping chip skips what lies between its timers. */
static avr_cycle_count_t pace(avr_t *a, avr_cycle_count_t when, void *param) {
    (void)a, (void)param;
    start_ns += start_ns ? waited_ns() : 0;
    int64_t now = now_ns(), run_ns = slower * when * 1000 / (HERTZ / 1000000);
    if (!start_ns) start_ns = now - run_ns;
    int64_t due = start_ns + run_ns;
    soonest_ns += slower * PACE_CYCLES * 500 / (HERTZ / 1000000);
    if (soonest_ns < now - MOST_HURRY_NS) soonest_ns = now - MOST_HURRY_NS;
    if (due < soonest_ns) due = soonest_ns;
    struct timespec t = {due / 1000000000, due % 1000000000};
    if (due > now + LEAST_SLEEP_NS) clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
    shared[CYCLE] = when;
    listen_outside();
    feed_serial();
    return when + PACE_CYCLES;
}

static void sleep_in_loop(avr_t *a, avr_cycle_count_t cycles) { (void)a, (void)cycles; }

int main(int argc, char **argv) {
    elf_firmware_t firmware = {0};
    if (argc != 4 || (slower = atoi(argv[2])) < 1 || elf_read_firmware(argv[1], &firmware)) return 2;
    shared = mmap(NULL, SHARED * sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED, open(argv[3], O_RDWR), 0);
    if (shared == MAP_FAILED) return 2;
    shared[READ] = UINT64_MAX;
    avr = avr_make_mcu_by_name("atmega328p");
    avr_init(avr);
    firmware.frequency = HERTZ;
    avr_load_firmware(avr, &firmware);
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->sleep = sleep_in_loop;

    char path[64];
    struct termios raw;
    if (openpty(&line, &keeper, path, NULL, NULL)) return 2;
    tcgetattr(keeper, &raw), cfmakeraw(&raw), tcsetattr(keeper, TCSANOW, &raw);
    fcntl(line, F_SETFL, O_NONBLOCK);
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_t *uart = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), 0);
    avr_irq_register_notify(uart + UART_IRQ_OUTPUT, on_byte, NULL);
    avr_irq_register_notify(uart + UART_IRQ_OUT_XON, on_flow, &may_send);
    avr_irq_register_notify(uart + UART_IRQ_OUT_XOFF, on_flow, NULL);
    for (intptr_t i = 0; i < 3; i++) {
        avr_irq_t *port = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ("BCD"[i]), 0);
        avr_irq_register_notify(port + IOPORT_IRQ_REG_PORT, on_port, (void *)(i << 1));
        avr_irq_register_notify(port + IOPORT_IRQ_DIRECTION_ALL, on_port, (void *)(i << 1 | 1));
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    prctl(PR_SET_TIMERSLACK, 1UL);
    printf("pty %s\n", path);
    avr_cycle_timer_register(avr, PACE_CYCLES, pace, NULL);
    for (;;) {
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) return 1;
        if (!reset_wanted) continue;
        uint64_t cycle = avr->cycle; /* the wall clock goes on */
        avr_reset(avr);
        avr->cycle = cycle;
        avr_cycle_timer_register(avr, PACE_CYCLES, pace, NULL);
        reset_wanted = 0;
    }
}
