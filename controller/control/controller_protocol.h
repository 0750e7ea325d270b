#ifndef DEXCHECK_CONTROLLER_PROTOCOL_H_
#define DEXCHECK_CONTROLLER_PROTOCOL_H_

/* How dexcheck talks to a controller that is a program of its own (C, or any language that reads bytes), or a
 * shared library in C, which is below.
 *
 * dexcheck writes to the program's standard input and reads from its standard output; standard error is the
 * user's. Numbers are of the machine: IEEE doubles and 32-bit integers in its byte order. Both sides take
 * turns:
 *
 *   dexcheck  hello, the parameter file's text, the scenario's text
 *   dexcheck  K_p, K_v                   only without contacts: n doubles each, gains of the joints
 *   program   reply to it: what it wants and reports
 *   dexcheck  message SET_PARAMETERS     | only to one that wants DEXCHECK_PARAMETERS
 *   program   message SET_PARAMETERS     | without a text
 *   dexcheck  message STEP, doubles      |
 *   program   message STEP, doubles      | at each time step
 *   dexcheck  message BEGIN              once, between the steps at rest and the run; no reply
 *   dexcheck  message END                once; the program ends (also when its standard input does)
 *
 * The text of SET_PARAMETERS has a line "NAME VALUE" for each number that the run gives its controller
 * (controller.NAME of the scenario). In the place of any message the program may send ERROR, with a text that
 * says in one line why it does not go on: in reply to SET_PARAMETERS for example that it knows no such name.
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

/* What a controller wants and reports. */
enum { DEXCHECK_TERMS = 1, DEXCHECK_TELLS_F_N = 2, DEXCHECK_PARAMETERS = 4 };
/* Types of messages. */
enum {
  DEXCHECK_STEP = 1,
  DEXCHECK_BEGIN = 2,
  DEXCHECK_END = 3,
  DEXCHECK_SET_PARAMETERS = 4,
  DEXCHECK_ERROR = 5
};

/* Names are those of C. NOLINTBEGIN(readability-identifier-naming) */
struct dexcheck_hello {
  char magic[8]; /* DEXCHECK_MAGIC */
  uint32_t protocol;
  uint32_t positions, velocities, contacts;
  uint32_t robot_bytes, scenario_bytes; /* of the texts that follow */
  double time_step;                     /* between two requests, s */
  double K_v[6], K_p[6];                /* of (55), 1/s, 1/s^2 */
  double mu, f_min, f_max;              /* -, N, N */
  double barrier_weight;                /* of the grasp-force problem, N */
};

struct dexcheck_hello_answer {
  char magic[8];
  uint32_t protocol;
  uint32_t flags; /* DEXCHECK_TERMS | DEXCHECK_TELLS_F_N | DEXCHECK_PARAMETERS */
};

struct dexcheck_message {
  uint32_t type;
  uint32_t doubles; /* that follow; of SET_PARAMETERS and ERROR: bytes of text */
};

/* The same for a shared library in C, which needs this header and nothing else: it defines these functions. A
 * text that they return is a line that says why the controller does not go on, and lives until the next call;
 * null when all is well. Without dexcheck_set_parameter a library takes no parameters; dexcheck_begin and
 * dexcheck_close may be missing. */
#ifdef __cplusplus
extern "C" {
#endif

/* DEXCHECK_PROTOCOL. */
uint32_t dexcheck_protocol(void);
/* A controller, or null. What it is given lives as long as it: K_p and K_v of the joints (n each), null with
 * contacts. Its flags are what it wants and reports. */
void* dexcheck_open(const struct dexcheck_hello* hello, const char* robot, const char* scenario,
                    const double* joint_gains, uint32_t* flags);
const char* dexcheck_set_parameter(void* controller, const char* name, double value);
void dexcheck_begin(void* controller);
/* State and torques are the doubles of STEP. */
const char* dexcheck_step(void* controller, const double* state, double* torques);
void dexcheck_close(void* controller);
/* NOLINTEND(readability-identifier-naming) */

#ifdef __cplusplus
}
#endif

#endif
