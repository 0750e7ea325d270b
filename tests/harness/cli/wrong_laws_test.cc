// Laws that are wrong, as people write them in Python: each mistake is named, alone and at its place. The
// program knows nothing of these files but their torques.

#include <cstdlib>
#include <random>

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::wrong_laws_test {
namespace {

constexpr const char* kHead = R"(import dexcheck
import numpy as np


class Law(dexcheck.Controller):
    def start(self, robot):
        self.Kp, self.Kv, self.dt = robot.K_p, robot.K_v, robot.time_step
        self.memory, self.I = None, 0

    def old(self, now):
        then, self.memory = self.memory, now
        return now if then is None else then

    def step(self, s):
        q, v, q_d, v_d, a_d = s.q, s.v, s.q_d, s.v_d, s.a_d
        M, C, g, F, Kp, Kv = s.M, s.C, s.gravity, s.friction, self.Kp, self.Kv
        e, e_dot = q_d - q, v_d - v
        i, k, size = @i, @k, @size
)";
constexpr const char* kRight = "        return M @ (a_d + Kv * e_dot + Kp * e) + C @ v + g + F\n";

struct WrongLaw {
  const char* mistake;      ///< Lines before the torques, or the torques themselves.
  const char* fault;        ///< How it is named; @joint is joint i.
  bool has_return = false;  ///< Whether it returns the torques.
};

constexpr WrongLaw kLaws[] = {
    {"g = size * g", "gravity (F_bar' (gravity)), factor"},
    {"C = 0 * C", "Coriolis forces (C_bar' q_dot), factor"},
    {"C = C.T", "Coriolis matrix transposed"},
    {"C = np.diag(np.diag(C))", "Coriolis matrix without coupling"},
    {"M = np.diag(np.diag(M))", "diagonal of M_bar' alone"},
    {"M = M.copy(); M[i, k] = M[k, i] = 0", "M_bar' without the coupling of @pair"},
    {"M = size * M", "mass matrix M_bar' (M_bar' (q_d_ddot + K_v e_dot + K_p e)), factor"},
    {"self.I = M.copy() if isinstance(self.I, int) else self.I; M = self.I", "M_bar' at the start"},
    {"Kp = size * Kp", "position feedback (K_p e), factor"},
    {"Kv = size * Kv", "velocity feedback (K_v e_dot), factor"},
    {"Kp = np.where(np.arange(e.size) == i, size, 1) * Kp", "gain K_p of @joint, factor"},
    {"e_dot = -v", "desired velocity in the feedback (K_v q_d_dot), factor"},
    {"a_d = 0 * a_d", "feed-forward acceleration (M_bar' q_d_ddot), factor"},
    {"v = v_d", "Coriolis forces of the desired velocity (C_bar' q_d_dot)"},
    {"e, e_dot = self.old((e.copy(), e_dot.copy()))", "feedback of the step before"},
    {"e_dot = v_d - self.old(v.copy())", "measured velocity in the feedback of the step before"},
    {"e = self.old(q_d.copy()) - q", "desired position of the step before"},
    {"M = self.old(M.copy())", "M_bar' of the step before"},
    {"self.memory = v.copy() if self.memory is None else self.memory + 0.4 * (v - self.memory)\n"
     "        e_dot = v_d - self.memory",
     "filter of the measured velocity in the feedback, share of the new one"},
    {"self.memory = e_dot.copy() if self.memory is None else self.memory + 0.2 * (e_dot - self.memory)\n"
     "        e_dot = self.memory",
     "filter of the velocity error, share of the new one"},
    {"M = np.tril(M)", "half of the mass matrix not mirrored"},
    {"e[[i, k]] = e[[k, i]]", "position errors of @pair exchanged"},
    {"self.I = self.I + e * self.dt; e = e + 5 * self.I", "integral of the position error, gain"},
    {"x = e[i]; e[i] = e[k]; e[k] = x; x = e_dot[i]; e_dot[i] = e_dot[k]; e_dot[k] = x",
     "errors of @pair exchanged"},
    {"e_dot[i] = v_d[i] + v[i]", "measured velocity of @joint with the other sign in the feedback"},
    {"F = F + 0.3 * np.sign(v_d)", "dry friction of all joints by the desired velocity"},
    {"F = F + 0.3 * np.tanh(v / 0.05)",
     "friction of all joints as tanh of the measured velocity over 0.05 rad/s"},
    {"F = F - 0.4 * v", "viscous friction of all joints by the measured velocity"},
    {"return M @ a_d + Kv * e_dot + Kp * e + C @ v + g + F", "feedback that M_bar' does not multiply", true},
    {"return Kv * e_dot + Kp * e + g", "feedback that M_bar' does not multiply, and gravity alone", true},
    {"t = M @ (a_d + Kv * e_dot + Kp * e) + C @ v + g + F; t[[i, k]] = t[[k, i]]; return t",
     "torques of @pair exchanged", true},
    {"t = M @ (a_d + Kv * e_dot + Kp * e) + C @ v + g + F; o = self.old(t); m = 2e-4 * abs(t).max()\n"
     "        self.I = self.I or m; self.memory = o + np.clip(t - o, -self.I, self.I); return self.memory",
     "limit of the change in a step of all torques", true},
    {"return (M @ (a_d + Kv * e_dot + Kp * e) + C @ v + g + F).astype(np.float32).astype(float)",
     "torques of single precision", true},
    {"return self.old(M @ (a_d + Kv * e_dot + Kp * e) + C @ v + g + F)", "torques of the step before", true},
    {"return np.round(M @ (a_d + Kv * e_dot + Kp * e) + C @ v + g + F, 2)", "all torques rounded to", true},
    {"t = M @ (a_d + Kv * e_dot + Kp * e) + C @ v + g + F; t[i] *= size; return t",
     "all torques (tau'), factor", true},
};

class OtherLaws : public CommandTest {
 protected:
  OtherLaws() { ::setenv("DEXCHECK_PYTHON", "/usr/bin/python3", /*replace=*/1); }

  ProgramResult RunLaw(const std::string& law) {
    Write("law.py", law);
    return Run(
        "run panda-reach --controller law.py --set duration=0.8 --set settle=0.1 --no-log --no-report --json "
        "result.json --quiet");
  }
};

class WrongLaws : public OtherLaws, public ::testing::WithParamInterface<size_t> {};

TEST_P(WrongLaws, AreNamed) {
  const WrongLaw& law = kLaws[GetParam()];
  const char* const seed = std::getenv("DEXCHECK_DRAWN_SEED");
  std::mt19937 random(static_cast<unsigned>((seed == nullptr ? 0 : std::atoi(seed)) * 100) +
                      static_cast<unsigned>(GetParam()));
  constexpr unsigned kJoints = 7;
  const unsigned i = random() % (kJoints - 1);
  const unsigned k = i + 1 + random() % (kJoints - 1 - i);
  const double size = 0.6 + 0.001 * static_cast<double>(random() % 300);
  const std::string joint = "panda_joint" + std::to_string(i + 1),
                    other = "panda_joint" + std::to_string(k + 1);
  const auto fill = [&](std::string text) {
    for (const auto& [from, to] : {std::pair<std::string, std::string>("@i", std::to_string(i)),
                                   {"@k", std::to_string(k)},
                                   {"@size", std::to_string(size)},
                                   {"@joint", joint},
                                   {"@pair", joint + " and " + other}}) {
      for (size_t at = text.find(from); at != std::string::npos; at = text.find(from))
        text.replace(at, from.size(), to);
    }
    return text;
  };
  const std::string mistake = "        " + std::string(law.mistake) + "\n";
  const ProgramResult result = RunLaw(fill(kHead) + mistake + (law.has_return ? "" : kRight));
  ASSERT_NE(result.exit_code, 0) << "agrees";
  ASSERT_NE(result.exit_code, 2) << result.err;
  const Json causes = ReadJson("result.json").at("causes");
  Json of_law = Json::array();
  for (const Json& cause : causes)
    if (cause.at("channel") == "law") of_law.push_back(cause);
  ASSERT_EQ(of_law.size(), 1U) << causes.dump(1);
  EXPECT_EQ(of_law[0].at("outcome"), "named") << of_law.dump(1);
  EXPECT_EQ(of_law[0].at("faults")[0].at("fault"), fill(law.fault)) << of_law.dump(1);
}

INSTANTIATE_TEST_SUITE_P(All, WrongLaws, ::testing::Range<size_t>(0, std::size(kLaws)));

// Mistakes that the table does not have are not named.
TEST_F(OtherLaws, AreNotExplained) {
  for (const char* mistake :
       {"e = np.round(q_d, 4) - q", "Kp = Kp * (1 + 0.1 * np.sin(20 * s.t))", "g = g * (1 + 0.1 * q[3])"}) {
    std::string head = kHead;
    for (const char* name : {"@i", "@k", "@size"})
      head.replace(head.find(name), std::string(name).size(), "1");
    RunLaw(head + "        " + mistake + "\n" + kRight);
    for (const Json& cause : ReadJson("result.json").at("causes")) {
      if (cause.at("channel") != "law") continue;
      EXPECT_EQ(cause.at("outcome"), "not explained") << mistake << cause.dump(1);
    }
  }
}

}  // namespace
}  // namespace dexcheck::testing::wrong_laws_test
