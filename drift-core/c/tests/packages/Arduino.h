// Stands in for an Arduino core: what the example calls.
#pragma once
#include <stdint.h>

struct SerialPort {
    void begin(unsigned long) {}
    void println(const char *) {}
};
static SerialPort Serial;
static const int A0 = 0;
static inline uint32_t micros() {
    static uint32_t us = 0;
    return us += 500;
}
static inline int analogRead(int) { return 300; }
static inline void analogWrite(int, int) {}
void setup();
void loop();
int main() {
    setup();
    for (;;) loop();
}
