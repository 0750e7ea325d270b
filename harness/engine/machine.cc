#include "harness/engine/machine.h"

#include <gnu/libc-version.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

#include "controller/common/text.h"
#include "harness/engine/mujoco_release.h"
#if defined(__x86_64__)
#define _Bool bool  // The header is written for C. NOLINT(bugprone-reserved-identifier)
#include <sys/platform/x86.h>

#include <utility>
#undef _Bool
#endif

namespace dexcheck {
namespace {

/// Features that libm's selectors of code check (ifunc-avx-fma4.h, ifunc-fma.h, ifunc-fma4.h,
/// ifunc-sse4_1.h), if they are in use: the system, or GLIBC_TUNABLES, may disable features of the processor.
std::string DescribeProcessor() {
#if defined(__x86_64__)
  std::string text = "x86_64";
  for (const auto& [name, is_active] :
       {std::pair(" SSE4.1", CPU_FEATURE_ACTIVE(SSE4_1)), std::pair(" AVX", CPU_FEATURE_ACTIVE(AVX)),
        std::pair(" AVX2", CPU_FEATURE_ACTIVE(AVX2)), std::pair(" FMA", CPU_FEATURE_ACTIVE(FMA)),
        std::pair(" FMA4", CPU_FEATURE_ACTIVE(FMA4))}) {
    if (is_active) text += name;
  }
  return text;
#elif defined(__aarch64__)
  return "aarch64";
#else
  return "another processor";
#endif
}

/// Describes the compiler and the instructions that it was allowed to use.
std::string DescribeBuild() {
  std::string text = "compiled by " __VERSION__;
#if defined(__AVX__)
  text += ", AVX";
#endif
#if defined(__AVX2__)
  text += ", AVX2";
#endif
#if defined(__AVX512F__)
  text += ", AVX512F";
#endif
#if defined(__FMA__)
  text += ", FMA";
#endif
#if !defined(__OPTIMIZE__)
  text += ", not optimised";
#endif
  return text;
}

}  // namespace

std::string DescribeMachine() {
  return DescribeProcessor() + "; glibc " + gnu_get_libc_version() + "; MuJoCo " + mj_versionString() + "; " +
         DescribeBuild();
}

std::string DescribeSettings(const mjModel& model, int integrator) {
  const mjOption& option = model.opt;
  std::string text;
  const auto add = [&](const std::string& name, const std::string& value) {
    text += name + ": " + value + "\n";
  };
  const auto list = [](std::span<const char* const> names, int flags) {
    std::string acting;
    for (size_t i = 0; i < names.size(); ++i) {
      if (((flags >> i) & 1) != 0) acting += (acting.empty() ? "" : " ") + std::string(names[i]);
    }
    return acting;
  };
  constexpr const char* kIntegrators[] = {"Euler", "RK4", "implicit", "implicitfast"};
  constexpr const char* kCones[] = {"pyramidal", "elliptic"};
  constexpr const char* kSolvers[] = {"PGS", "CG", "Newton"};
  add("time step", FormatNumber(option.timestep) + " s");
  add("integrator", kIntegrators[integrator]);
  add("cone", kCones[option.cone]);
  add("solver", kSolvers[option.solver]);
  add("iterations", std::to_string(option.iterations));
  add("tolerance", FormatNumber(option.tolerance));
  add("noslip iterations", std::to_string(option.noslip_iterations));
  add("impratio", FormatNumber(option.impratio));
  add("constraint Jacobian", mj_isSparse(&model) != 0 ? "sparse" : "dense");
  add("collider of convex bodies", std::to_string(GetColliderIterations(option)) + " iterations, tolerance " +
                                       FormatNumber(GetColliderTolerance(option)));
  add("features", list({mjDISABLESTRING, mjNDISABLE}, ~option.disableflags));
  add("further features", list({mjENABLESTRING, mjNENABLE}, option.enableflags));
  return text;
}

bool IsSameWithin(double tolerance, double a, double b, double scale) {
  if (std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b)) return true;
  if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && std::isnan(b);
  if (std::isinf(a) || std::isinf(b)) return a == b;
  return std::abs(a - b) <= tolerance * (1.0 + std::abs(scale));
}

}  // namespace dexcheck
