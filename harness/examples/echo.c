/* A controller as a program that answers at once, with no torque: what the transport alone takes. */

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "controller/control/controller_protocol.h"

static void ReadAll(void* data, size_t size) {
  char* to = data;
  while (size > 0) {
    const ssize_t got = read(STDIN_FILENO, to, size);
    if (got <= 0) exit(got < 0);
    to += got;
    size -= (size_t)got;
  }
}

static void WriteAll(const void* data, size_t size) {
  const char* from = data;
  while (size > 0) {
    const ssize_t sent = write(STDOUT_FILENO, from, size);
    if (sent < 0) exit(1);
    from += sent;
    size -= (size_t)sent;
  }
}

int main(void) {
  struct dexcheck_hello hello;
  ReadAll(&hello, sizeof(hello));
  size_t texts = (size_t)hello.robot_bytes + hello.scenario_bytes;
  if (hello.contacts == 0) texts += 2 * hello.velocities * sizeof(double); /* K_p, K_v of joints */
  char* text = malloc(texts + 1);
  ReadAll(text, texts);
  free(text);
  struct dexcheck_hello_answer answer = {DEXCHECK_MAGIC, DEXCHECK_PROTOCOL, 0};
  WriteAll(&answer, sizeof(answer));

  double request[4096];
  double reply[1 + 4096] = {0};
  const struct dexcheck_message header = {DEXCHECK_STEP, hello.velocities};
  memcpy(reply, &header, sizeof(header));
  for (;;) {
    struct dexcheck_message message;
    ReadAll(&message, sizeof(message));
    if (message.type == DEXCHECK_END) return 0;
    if (message.type == DEXCHECK_BEGIN) continue;
    if (message.doubles > 4096) return 1;
    ReadAll(request, message.doubles * sizeof(double));
    WriteAll(reply, (1 + (size_t)hello.velocities) * sizeof(double));
  }
}
