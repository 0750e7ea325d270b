#include "harness/view/gain_sliders.h"

#include <fmt/format.h>

namespace dexcheck {

std::vector<Slider> MakeGainSliders() { return {{"stiffness K_p"}, {"damping K_v"}, {"squeeze f_min"}}; }

std::vector<std::string> MakeGainOverrides(const Scenario& scenario, const std::vector<Slider>& sliders) {
  std::vector<std::string> overrides;
  const auto vector = [](const Vector6d& v) {
    return fmt::format("[{}, {}, {}, {}, {}, {}]", v[0], v[1], v[2], v[3], v[4], v[5]);
  };
  const ObjectGains& gains = scenario.control.gains;
  const double stiffness = sliders[0].factor;
  const double damping = sliders[1].factor;
  if (stiffness != 1.0 || damping != 1.0) {
    const Vector6d K_p = stiffness * gains.K_p;
    const Vector6d K_v = damping * gains.K_v;
    const bool has_frequency = scenario.text.find("natural_frequency") != std::string::npos;
    if (has_frequency) {
      const Vector6d omega = K_p.cwiseSqrt();
      overrides.push_back("control.natural_frequency=" + vector(omega));
      overrides.push_back("control.damping_ratio=" + vector(0.5 * K_v.cwiseQuotient(omega)));
    } else {
      overrides.push_back("control.K_p=" + vector(K_p));
      overrides.push_back("control.K_v=" + vector(K_v));
    }
  }
  if (sliders[2].factor != 1.0) {
    overrides.push_back(fmt::format("control.f_min={}", sliders[2].factor * scenario.control.f_min));
  }
  return overrides;
}

}  // namespace dexcheck
