// A PI loop at 1 kHz with drift in it. config.h is what `drift calibrate HEALTHY.csv --c config.h` writes for your loop.
#include <drift.h>

#include "config.h"

static drift_monitor_t monitor[DRIFT_PAIR_WORDS];
static drift_report_t report;

void setup() {
  Serial.begin(115200);
  if (drift_pair_init(monitor, DRIFT_PAIR_WORDS, &drift_config) != DRIFT_OK) {
    Serial.println("drift: impossible configuration");
  }
}

void loop() {
  static float integral = 0.0f;
  static uint32_t next_us = micros();
  if ((int32_t)(micros() - next_us) < 0) return;
  next_us += 1000;

  const float r = 1.0f;
  const float y = analogRead(A0) * (3.3f / 1023.0f);
  integral += 0.02f * (r - y);
  const float u = 2.0f * (r - y) + integral;
  analogWrite(9, (int)(u * 85.0f));

  if (drift_tick(monitor, r, y, u, &report) == DRIFT_REPORT && report.verdict == DRIFT_DRIFT) {
    Serial.println("drift");
  }
}
