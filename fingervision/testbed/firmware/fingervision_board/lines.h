// The lines between board and motor controller: which pin is what, and how they change together.
#pragma once
#include <Arduino.h>
#include <util/atomic.h>

namespace lines {

constexpr uint8_t SELECTS = 4;
enum Role : uint8_t { SELECT_0, DRIVE = SELECTS, ENABLE, HOLD, BUSY, ALARM, IN_POSITION, FORCE, ROLES };
constexpr uint8_t NO_PIN = 0xFF;
constexpr uint8_t FIRST_PIN = 2, LAST_PIN = 19;  // 0 and 1 are the serial line; 14 to 19 are A0 to A5

struct Line {
    uint8_t pin;
    bool active_high;
    volatile uint8_t *out;
    volatile uint8_t *in;
    uint8_t mask;
};

Line map[ROLES];

bool mapped(uint8_t role) { return map[role].pin != NO_PIN; }
bool is_output(uint8_t role) { return role < BUSY; }

// All pins to inputs, no line known: what the board is after a reset.
void unmap() {
    for (uint8_t pin = FIRST_PIN; pin <= LAST_PIN; pin++) pinMode(pin, INPUT);
    for (Line &line : map) line.pin = NO_PIN;
}

bool set(uint16_t role, uint16_t pin, bool active_high) {
    if (role >= ROLES || pin < FIRST_PIN || pin > LAST_PIN) return false;
    if (role == FORCE && pin < A0) return false;
    for (const Line &other : map)
        if (other.pin == pin) return false;
    uint8_t port = digitalPinToPort(pin);
    map[role] = {uint8_t(pin), active_high, portOutputRegister(port), portInputRegister(port), digitalPinToBitMask(pin)};
    return true;
}

// Whether all that a move needs is known, with select and drive lines on one port, so that one write sets them.
bool can_move() {
    for (uint8_t role = SELECT_0; role <= DRIVE; role++)
        if (!mapped(role) || map[role].out != map[DRIVE].out) return false;
    return mapped(BUSY) && mapped(ALARM);
}

void write(uint8_t role, bool active) {
    if (!mapped(role)) return;
    const Line &line = map[role];
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (active == line.active_high) *line.out |= line.mask;
        else *line.out &= ~line.mask;
    }
}

bool active(uint8_t role) {
    if (!mapped(role)) return false;
    const Line &line = map[role];
    return bool((is_output(role) ? *line.out : *line.in) & line.mask) == line.active_high;
}

// Select lines and the drive line in one write of the port.
void select(uint8_t code, bool drive) {
    uint8_t ones = 0, all = 0;
    for (uint8_t role = SELECT_0; role <= DRIVE; role++) {
        bool on = role == DRIVE ? drive : bool(code >> role & 1);
        all |= map[role].mask;
        if (on == map[role].active_high) ones |= map[role].mask;
    }
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { *map[DRIVE].out = (*map[DRIVE].out & ~all) | ones; }
}

// Make pins outputs with every line inactive; the level stands before the pin drives it.
void begin() {
    for (uint8_t role = 0; role < BUSY; role++) write(role, false);
    for (uint8_t role = 0; role < BUSY; role++)
        if (mapped(role)) pinMode(map[role].pin, OUTPUT);
}

}  // namespace lines
