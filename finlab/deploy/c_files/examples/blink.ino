// Blinks once a second where the self-test holds, ten times a second where it does not.
// The C files lie in src/ of this sketch's folder.
#include "src/robot.h"

static int wrong;

void setup() {
  pinMode(LED_BUILTIN, OUTPUT);
  wrong = robot_selftest();
}

void loop() {
  digitalWrite(LED_BUILTIN, HIGH);
  delay(wrong ? 50 : 500);
  digitalWrite(LED_BUILTIN, LOW);
  delay(wrong ? 50 : 500);
}
