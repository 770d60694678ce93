// The wire: one message a line, `words*CRC\n`; the CRC is CRC-16/XMODEM of what stands before the asterisk, in hex.
#pragma once
#include <Arduino.h>
#include <util/crc16.h>

namespace wire {

constexpr uint8_t LONGEST = 48;  // a command; what is longer is noise

char line[LONGEST + 1];
uint8_t length = 0;
bool overlong = false;
uint16_t crc_out;

void begin(uint32_t baud) { Serial.begin(baud); }

uint16_t crc_of(const char *text, uint8_t count) {
    uint16_t crc = 0;
    for (uint8_t i = 0; i < count; i++) crc = _crc_xmodem_update(crc, text[i]);
    return crc;
}

void put(char c) {
    crc_out = _crc_xmodem_update(crc_out, c);
    Serial.write(c);
}

char digit(uint8_t value) { return value < 10 ? '0' + value : 'A' + value - 10; }

// A space, then so many hexadecimal digits.
void put_hex(uint32_t value, uint8_t digits) {
    put(' ');
    while (digits--) put(digit((value >> (4 * digits)) & 0xF));
}

void put_word(const __FlashStringHelper *word) {
    put(' ');
    for (PGM_P p = reinterpret_cast<PGM_P>(word); char c = pgm_read_byte(p); p++) put(c);
}

void open(char kind) {
    crc_out = 0;
    put(kind);
}

void close() {
    uint16_t crc = crc_out;
    Serial.write('*');
    for (uint8_t digits = 4; digits--;) Serial.write(digit((crc >> (4 * digits)) & 0xF));
    Serial.write('\n');
}

// The value of a hexadecimal word at `at`, which is moved behind it and one space; `fine` is cleared if it is none.
uint32_t hex_at(uint8_t &at, bool &fine) {
    uint32_t value = 0;
    uint8_t digits = 0;
    for (; at < length && line[at] != ' '; at++, digits++) {
        char c = line[at];
        if (c >= '0' && c <= '9') value = value << 4 | (c - '0');
        else if (c >= 'A' && c <= 'F') value = value << 4 | (c - 'A' + 10);
        else fine = false;
    }
    if (digits == 0 || digits > 8) fine = false;
    if (at < length) at++;
    return value;
}

// Take what has come; true once a whole line with a true checksum stands in `line` without its checksum.
bool received() {
    while (Serial.available()) {
        char c = Serial.read();
        if (c != '\n') {
            if (length < LONGEST) line[length++] = c;
            else overlong = true;
            continue;
        }
        uint8_t whole = length;
        bool fine = !overlong && whole > 5 && line[whole - 5] == '*';
        length = 0;
        overlong = false;
        if (!fine) continue;
        uint8_t at = whole - 4;
        length = whole;
        uint16_t stated = hex_at(at, fine);
        length = whole - 5;
        if (fine && stated == crc_of(line, length)) return true;
        length = 0;
    }
    return false;
}

void forget() { length = 0; }

}  // namespace wire
