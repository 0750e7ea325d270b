/* A controller's library in C with a fault that the environment chooses: FAULT is protocol, open, step,
 * crash, exit, text (it returns no text), beyond (it writes far past the torques), or none. */

#include <stdlib.h>
#include <string.h>

#include "controller/control/controller_protocol.h"

static int Has(const char* fault) {
  const char* chosen = getenv("FAULT");
  return chosen != NULL && strcmp(chosen, fault) == 0;
}

uint32_t dexcheck_protocol(void) { return Has("protocol") ? 7 : DEXCHECK_PROTOCOL; }

void* dexcheck_open(const struct dexcheck_hello* hello, const char* robot, const char* scenario,
                    const double* joint_gains, uint32_t* flags) {
  static size_t n;
  (void)robot, (void)scenario, (void)joint_gains, (void)flags;
  n = hello->velocities;
  return Has("open") ? NULL : &n;
}

const char* dexcheck_step(void* controller, const double* state, double* torques) {
  const size_t n = *(size_t*)controller;
  (void)state;
  if (Has("step")) return "the widget is out of cheese";
  if (Has("crash")) abort();
  if (Has("exit")) exit(0);
  if (Has("text")) return (const char*)8;
  if (Has("beyond")) memset(torques, 0x55, 1u << 28);
  memset(torques, 0, n * sizeof(double));
  return NULL;
}
