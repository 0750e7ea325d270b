/* A controller of one's own in C, for an arm that holds nothing: springs and dampers at the joints, weighted
 * by the inertia, with the weight carried. Its parameters are controller.stiffness, 1/s^2, and
 * controller.damping, 1/s. README.md says how it is compiled and run. */

#include <stdlib.h>
#include <string.h>

#include "controller/control/controller_protocol.h"

struct law {
  size_t n;
  double stiffness, damping;
};

uint32_t dexcheck_protocol(void) { return DEXCHECK_PROTOCOL; }

void* dexcheck_open(const struct dexcheck_hello* hello, const char* robot, const char* scenario,
                    const double* joint_gains, uint32_t* flags) {
  (void)robot, (void)scenario;
  if (joint_gains == NULL) return NULL; /* there are contacts: no motion of joints */
  struct law* law = malloc(sizeof(*law));
  *law = (struct law){hello->velocities, 400.0, 40.0};
  *flags = DEXCHECK_TERMS;
  return law;
}

const char* dexcheck_set_parameter(void* controller, const char* name, double value) {
  struct law* law = controller;
  if (strcmp(name, "stiffness") == 0) {
    law->stiffness = value;
  } else if (strcmp(name, "damping") == 0) {
    law->damping = value;
  } else {
    return "is none of its parameters: it takes stiffness, damping";
  }
  return NULL;
}

const char* dexcheck_step(void* controller, const double* state, double* torques) {
  const struct law* law = controller;
  const size_t n = law->n;
  const double* q = state + 19;
  const double* q_dot = q + n;
  const double* q_d =
      q_dot + n + 25; /* after the object's pose, velocity and coordinates, and the support's force */
  const double* q_d_dot = q_d + n;
  const double* M = q_d + 3 * n;
  const double* gravity = M + 2 * n * n; /* after C */
  for (size_t i = 0; i < n; ++i) torques[i] = gravity[i];
  for (size_t j = 0; j < n; ++j) {
    const double feedback = law->stiffness * (q_d[j] - q[j]) + law->damping * (q_d_dot[j] - q_dot[j]);
    for (size_t i = 0; i < n; ++i) torques[i] += M[i * n + j] * feedback;
  }
  return NULL;
}

void dexcheck_close(void* controller) { free(controller); }
