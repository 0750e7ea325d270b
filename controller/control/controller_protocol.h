#ifndef DEXCHECK_CONTROLLER_PROTOCOL_H_
#define DEXCHECK_CONTROLLER_PROTOCOL_H_

/* How dexcheck talks to a controller that is a program of its own (C, or any language that reads bytes).
 *
 * dexcheck writes to the program's standard input and reads from its standard output; standard error is the
 * user's. Numbers are of the machine: IEEE doubles and 32-bit integers in its byte order. Both sides take
 * turns:
 *
 *   dexcheck  hello, the parameter file's text, the scenario's text
 *   dexcheck  K_p, K_v                   only without contacts: n doubles each, gains of the joints
 *   program   reply to it: what it wants and reports
 *   dexcheck  message STEP, doubles      |
 *   program   message STEP, doubles      | at each time step
 *   dexcheck  message BEGIN              once, between the steps at rest and the run; no reply
 *   dexcheck  message END                once; the program ends (also when its standard input does)
 *
 * Doubles of STEP from dexcheck; p positions, n velocities, N contacts, k = 3 N; matrices row by row, SI
 * units:
 *
 *   t                          1     s, since the run, or the rest before it, began
 *   X_d, X_d_dot, X_d_ddot     18    desired motion, ZYZ angles; X_d_dot at the velocities' own time
 *   q', xi                     p, n
 *   R_Bo, p_Bo                 9, 3  pose of the object
 *   V_Bo                       6     its body velocity
 *   X_o                        6     its coordinates, on one branch of the angles; zero with
 *                                    control.orientation = "rotation"
 *   kappa                      5 N   u_f v_f u_o v_o psi of each contact
 *   overlap                    N     m
 *   touching                   N     1 or 0 for each fingertip
 *   support force              1     N
 *
 * and without contacts, in a scenario that moves joints, where what is said of an object means nothing:
 *
 *   q_d, q_d_dot, q_d_ddot     3 n   desired motion of the joints; q_d_dot at the velocities' own time
 *
 * and, when the program wants DEXCHECK_TERMS, the model's terms at that state (controller/NOTATION.md):
 *
 *   M_bar', C_bar'             n n, n n
 *   gravity, friction          n, n   parts of F_bar'
 *   J_B', J_B_dot'             k n, k n
 *   G, G_dot                   6 k, 6 k
 *   M_hat, C_hat V_o, N_o      36, 6, 6
 *   sigma'                     n      of the posture task
 *   E_bar'^-1                  4      its block of the wheels; a unit matrix without
 *
 * Doubles of STEP from the program: tau' (n), N m: right wheel, left wheel, then joints; after
 * DEXCHECK_TELLS_F_N also the internal force F_N (k), which a check of the law needs.
 */

#include <stdint.h>

#define DEXCHECK_MAGIC "DEXCTRL"
#define DEXCHECK_PROTOCOL 1

enum { DEXCHECK_TERMS = 1, DEXCHECK_TELLS_F_N = 2 };
enum { DEXCHECK_STEP = 1, DEXCHECK_BEGIN = 2, DEXCHECK_END = 3 };

struct dexcheck_hello {
  char magic[8]; /* DEXCHECK_MAGIC */
  uint32_t protocol;
  uint32_t positions, velocities, contacts;
  uint32_t robot_bytes, scenario_bytes; /* of the texts that follow */
  double time_step;                     /* s */
  double K_v[6], K_p[6];                /* of (55), 1/s, 1/s^2 */
  double mu, f_min, f_max;              /* -, N, N */
  double barrier_weight;                /* of the grasp-force problem, N */
};

struct dexcheck_hello_answer {
  char magic[8];
  uint32_t protocol;
  uint32_t flags; /* DEXCHECK_TERMS | DEXCHECK_TELLS_F_N */
};

struct dexcheck_message {
  uint32_t type;
  uint32_t doubles; /* that follow */
};

#endif
