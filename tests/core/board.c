/* Start of a program on qemu's `mps2-an500` (Cortex-M7): the self-test, then its result, static bytes and stack by
   UART 0, and the exit code by semihosting. */
#include "robot.h"
#include <stdint.h>

extern uint32_t data_load, data_begin, data_end, bss_begin, bss_end, stack_low, stack_top;
#define UART ((volatile uint32_t *)0x40004000)
#define UNTOUCHED 0xdeadbeefu

static void text(const char *s) {
  while (*s) {
    while (UART[1] & 1) {} /* full */
    UART[0] = (uint32_t)*s++;
  }
}

static void number(const char *name, unsigned value) {
  char digits[12], *at = digits + sizeof digits - 1;
  *at = 0;
  do *--at = (char)('0' + value % 10);
  while (value /= 10);
  text(name), text(" "), text(at), text("\n");
}

static void leave(int failed) {
  register uint32_t call __asm__("r0") = 0x18, why __asm__("r1") = failed ? 0x20023 : 0x20026;
  __asm__ volatile("bkpt 0xab" : : "r"(call), "r"(why) : "memory");
  for (;;) {}
}

static void fault(void) { text("fault\n"), leave(1); }

void reset(void) {
  *(volatile uint32_t *)0xe000ed88 |= 0xfu << 20; /* floating point on */
  __asm__ volatile("dsb\n isb");
  for (uint32_t *to = &data_begin, *from = &data_load; to < &data_end;) *to++ = *from++;
  for (uint32_t *to = &bss_begin; to < &bss_end;) *to++ = 0;
  volatile uint32_t *low = &stack_low;
  uint32_t here;
  while (low < &here - 64) *low++ = UNTOUCHED;
  UART[4] = 16, UART[2] = 1;
  int wrong = robot_selftest();
  for (low = &stack_low; *low == UNTOUCHED;) low++;
  number("differ", (unsigned)wrong);
  number("static", (unsigned)((char *)&bss_end - (char *)&data_begin));
  number("stack", (unsigned)((char *)&stack_top - (char *)low));
  leave(wrong != 0);
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {&stack_top, reset, fault, fault, fault,
                                                                             fault,      fault, fault, fault};
