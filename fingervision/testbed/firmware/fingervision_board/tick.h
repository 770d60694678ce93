// The tick: a thousand times a second, whatever the main loop does. It watches the inputs, guards the drive line and
// starts the force conversions, so that a blocked serial line can neither delay a sample nor keep the motor driven.
#pragma once
#include <Arduino.h>
#include "lines.h"

namespace tick {

enum Cause : char { NONE = '-', SILENCE = 'w', TOO_LONG = 'l', ALARMED = 'a', HOST = 'h' };
enum Bit : uint8_t { BIT_DRIVE, BIT_ENABLE, BIT_HOLD, BIT_BUSY, BIT_ALARM, BIT_IN_POSITION, BIT_BUSY_SEEN };

struct Sample { uint16_t number; uint32_t time_us; uint16_t level; };
struct Change { uint8_t number; uint32_t time_us; uint8_t levels; };

// A queue that one side fills and the other empties; what finds it full is lost, and its number is missing then.
template <typename T, uint8_t SIZE> struct Queue {
    T slots[SIZE];
    volatile uint8_t first = 0, last = 0;
    void push(const T &item) {
        uint8_t next = (last + 1) % SIZE;
        if (next == first) return;
        slots[last] = item;
        last = next;
    }
    bool pop(T &item) {
        if (first == last) return false;
        item = slots[first];
        first = (first + 1) % SIZE;
        return true;
    }
    bool empty() const { return first == last; }
};

// A motor that stands enabled is let go of after so many times the silence that a moving one is stopped by.
constexpr uint16_t STANDING = 10;

Queue<Sample, 32> samples;
Queue<Change, 16> changes;

volatile bool running = false;
volatile char cause = NONE;
volatile bool busy_seen = false;
volatile uint8_t levels = 0;
volatile uint16_t silent_ms = 0;

uint8_t period_ms, settle_ms;
uint16_t watchdog_ms;
volatile uint16_t settle_left_ms;
volatile uint32_t driven_ms, longest_ms;  // a slow motion takes minutes
volatile bool settling = false;
uint16_t since_sample_ms, sample_number;
uint8_t change_number;
uint32_t sample_time_us;

uint8_t read_levels() {
    uint8_t now = 0;
    for (uint8_t bit = BIT_DRIVE; bit <= BIT_IN_POSITION; bit++)
        if (lines::active(lines::DRIVE + bit)) now |= 1 << bit;
    if (busy_seen) now |= 1 << BIT_BUSY_SEEN;
    return now;
}

// Drop what moves the motor: the drive line first.
void drop(char why) {
    settling = false;
    lines::write(lines::DRIVE, false);
    lines::write(lines::ENABLE, false);
    lines::write(lines::HOLD, true);
    if (cause == NONE) cause = why;
}

void notice() {
    uint8_t now = read_levels();
    if (now & 1 << BIT_DRIVE && now & 1 << BIT_BUSY) busy_seen = true, now |= 1 << BIT_BUSY_SEEN;
    if (now == levels) return;
    levels = now;
    changes.push({change_number++, micros(), now});
}

void start_conversion() {
    sample_time_us = micros();  // the level is held 12 us later (1.5 cycles of the converter's clock)
    ADCSRA |= _BV(ADSC);
}

void go(uint8_t force_period_ms, uint16_t silence_ms, uint8_t settle) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        period_ms = force_period_ms;
        watchdog_ms = silence_ms;
        settle_ms = settle;
        silent_ms = driven_ms = 0;
        since_sample_ms = sample_number = 0;
        change_number = 0;
        levels = 0;
        cause = NONE;
        busy_seen = settling = false;
        samples.first = samples.last = changes.first = changes.last = 0;
        if (lines::mapped(lines::FORCE)) {
            ADMUX = _BV(REFS0) | (lines::map[lines::FORCE].pin - A0);           // against AVcc
            ADCSRA = _BV(ADEN) | _BV(ADIE) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);  // 125 kHz
        }
        TCCR1A = 0;
        TCCR1B = _BV(WGM12) | _BV(CS11) | _BV(CS10);  // clear on compare, 250 kHz
        OCR1A = F_CPU / 64 / 1000 - 1;
        TCNT1 = 0;
        TIFR1 = _BV(OCF1A);
        TIMSK1 = _BV(OCIE1A);
        running = true;
    }
}

void halt() {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        drop(HOST);
        levels = 0;
        TIMSK1 = 0;
        ADCSRA = 0;
        running = false;
    }
}

// Begin a move: the step's code, then after the settling time the drive line; no settling sets both in one write.
void move(uint8_t code, uint32_t at_most_ms) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        busy_seen = false;
        driven_ms = 0;
        longest_ms = at_most_ms;
        settle_left_ms = settle_ms + 1;  // the tick under way counts too, however little of it is left
        settling = settle_ms > 0;
        lines::select(code, !settling);
        notice();
    }
}

void release() {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        settling = false;
        lines::write(lines::DRIVE, false);
    }
}

void heard() {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { silent_ms = 0; }
}

}  // namespace tick

ISR(TIMER1_COMPA_vect) {
    using namespace tick;
    if (settling && --settle_left_ms == 0) {
        settling = false;
        lines::write(lines::DRIVE, true);
    }
    bool driven = lines::active(lines::DRIVE);
    bool moving = driven || settling;
    if (silent_ms < 0xFFFF) silent_ms++;
    if (moving && silent_ms >= watchdog_ms) drop(SILENCE);
    if (lines::active(lines::ENABLE) && silent_ms >= STANDING * watchdog_ms) drop(SILENCE);
    if (driven && ++driven_ms > longest_ms) drop(TOO_LONG);
    if (moving && lines::active(lines::ALARM)) drop(ALARMED);
    notice();
    if (lines::mapped(lines::FORCE) && ++since_sample_ms >= period_ms) {
        since_sample_ms = 0;
        start_conversion();
    }
}

ISR(ADC_vect) {
    using namespace tick;
    samples.push({sample_number++, sample_time_us, ADC});
}
