// The board of fingervision's test bed: step select, drive, busy and alarm lines of a motor controller, and a force
// sensor, over USB. ATmega328P at 16 MHz (Arduino Uno, Nano). The protocol is described in ../README.md.
#include <avr/sleep.h>
#include "lines.h"
#include "tick.h"
#include "wire.h"

#if !defined(__AVR_ATmega328P__)
#error "This sketch sets registers of the ATmega328P: choose an Arduino Uno or Nano."
#endif

constexpr uint8_t PROTOCOL = 1;
#define VERSION "1.0"
constexpr uint32_t BAUD = 115200;
constexpr uint8_t SAMPLE_LENGTH = 26;  // bytes of a sample's line; sent only when they fit, so that sending never waits

uint16_t session = 0;  // given by the computer at set-up; 0 after a reset, which is how a reset is seen
int16_t last_number = -1;
uint16_t last_crc;
const __FlashStringHelper *last_refusal;

bool send_change() {
    tick::Change change;
    if (!tick::changes.pop(change)) return false;
    wire::open('L');
    wire::put_hex(change.number, 2);
    wire::put_hex(change.time_us, 8);
    wire::put_hex(change.levels, 2);
    wire::close();
    return true;
}

void answer(uint8_t number, uint32_t time_us) {
    uint8_t levels, seen;
    char cause;
    // No state overtakes the changes that led to it: the computer knows their times from them alone.
    for (bool told = false; !told;) {
        while (send_change()) {}
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
            if (tick::running) tick::notice();
            told = tick::changes.empty();
            levels = tick::levels;
            seen = tick::change_number;
            cause = tick::cause;
        }
    }
    wire::open('A');
    wire::put_hex(number, 2);
    wire::put_hex(time_us, 8);
    wire::put_hex(session, 4);
    wire::put_hex(levels, 2);
    wire::put_hex(seen, 2);
    wire::put(' ');
    wire::put(cause);
    wire::close();
}

void refuse(uint8_t number, const __FlashStringHelper *why) {
    wire::open('N');
    wire::put_hex(number, 2);
    wire::put_word(why);
    wire::close();
}

void identify(uint8_t number) {
    wire::open('I');
    wire::put_hex(number, 2);
    wire::put_word(F("fingervision-board"));
    wire::put_hex(PROTOCOL, 2);
    wire::put_word(F(VERSION));
    wire::close();
}

// Why no move may begin, or nothing.
const __FlashStringHelper *hindrance() {
    if (!tick::running || !lines::can_move()) return F("not-set-up");
    if (tick::cause != tick::NONE) return F("stopped");
    if (lines::active(lines::ALARM)) return F("alarm");
    return nullptr;
}

const __FlashStringHelper *start(uint8_t &at, bool &fine) {
    uint16_t given = wire::hex_at(at, fine);
    uint16_t period_ms = wire::hex_at(at, fine), silence_ms = wire::hex_at(at, fine), settle = wire::hex_at(at, fine);
    if (!fine || given == 0 || period_ms < 4 || period_ms > 255 || silence_ms < 10 || settle > 255) return F("value");
    if (!lines::can_move() && !lines::mapped(lines::FORCE)) return F("map");
    session = given;
    lines::begin();
    tick::go(period_ms, silence_ms, settle);
    return nullptr;
}

const __FlashStringHelper *move(uint8_t &at, bool &fine) {
    uint16_t code = wire::hex_at(at, fine);
    uint32_t at_most_ms = wire::hex_at(at, fine);
    if (!fine || code > 15 || at_most_ms == 0) return F("value");
    if (const __FlashStringHelper *why = hindrance()) return why;
    if (tick::settling || lines::active(lines::DRIVE) || lines::active(lines::BUSY)) return F("busy");
    tick::move(code, at_most_ms);
    return nullptr;
}

// Do a command once; the reason if it cannot be done, or nothing.
const __FlashStringHelper *obey(char kind, uint8_t &at, bool &fine) {
    switch (kind) {
        case 'U':  // unmap: back to what a reset makes
            tick::halt();
            lines::unmap();
            session = 0;
            return nullptr;
        case 'M': {  // map a line: role, pin, active level
            if (tick::running) return F("running");
            uint16_t role = wire::hex_at(at, fine), pin = wire::hex_at(at, fine), level = wire::hex_at(at, fine);
            return fine && level <= 1 && lines::set(role, pin, level) ? nullptr : F("value");
        }
        case 'G':  // go: session, force period, silence, settling (ms)
            return tick::running ? F("running") : start(at, fine);
        case 'E': {  // enable line
            uint16_t on = wire::hex_at(at, fine);
            if (!fine || on > 1) return F("value");
            if (const __FlashStringHelper *why = on ? hindrance() : nullptr) return why;
            lines::write(lines::ENABLE, on);
            return nullptr;
        }
        case 'R':  // run a step: code, longest time (ms)
            return move(at, fine);
        case 'X':  // release the drive line
            tick::release();
            return nullptr;
        case 'Z':  // stop
            ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { tick::drop(tick::HOST); }
            return nullptr;
        case 'K':  // the stop is known: moves may begin again
            if (lines::active(lines::ALARM)) return F("alarm");
            tick::cause = tick::NONE;
            lines::write(lines::HOLD, false);
            return nullptr;
        default:
            return F("unknown");
    }
}

// Commands are `number kind words`. A number that comes again is the same command sent twice, since its answer was
// lost: it is answered, and not done again.
void handle(uint32_t time_us) {
    uint8_t at = 0;
    bool fine = true;
    uint8_t number = wire::hex_at(at, fine);
    if (!fine || at >= wire::length) return;
    char kind = wire::line[at];
    at += 2;
    tick::heard();
    if (kind == 'I') return identify(number);
    if (kind == 'S') return answer(number, time_us);  // state
    uint16_t crc = wire::crc_of(wire::line, wire::length);
    if (number != last_number || crc != last_crc) {
        last_refusal = obey(kind, at, fine);
        last_number = number;
        last_crc = crc;
    }
    if (last_refusal) refuse(number, last_refusal);
    else answer(number, time_us);
}

bool send_sample() {
    tick::Sample sample;
    if (!tick::samples.pop(sample)) return false;
    wire::open('F');
    wire::put_hex(sample.number, 4);
    wire::put_hex(sample.time_us, 8);
    wire::put_hex(sample.level, 3);
    wire::close();
    return true;
}

// Changes of lines first, then samples; only what the serial buffer takes at once.
bool send_queued() {
    if (tick::changes.empty() && tick::samples.empty()) return false;
    if (Serial.availableForWrite() < SAMPLE_LENGTH) return false;
    return send_change() || send_sample();
}

void setup() {
    lines::unmap();
    wire::begin(BAUD);
    set_sleep_mode(SLEEP_MODE_IDLE);
}

void loop() {
    if (wire::received()) {
        handle(micros());
        wire::forget();
    }
    // Idle until the next interrupt, a millisecond at most: the converter measures with less noise beside it.
    if (!send_queued() && !Serial.available()) sleep_mode();
}
