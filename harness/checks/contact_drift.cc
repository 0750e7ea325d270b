#include "harness/checks/contact_drift.h"

#include <cmath>

namespace dexcheck {
namespace {

/// Followed and measured contact farther apart than this have nothing to do with each other any more, and one
/// may lie at the pole of the other's chart, m. Less than from a chart's margin to its pole, 4 mm on a
/// fingertip of 9 mm.
constexpr double kStray = 1e-3;

double CalcDistance(const Surface& surface, const SurfacePoint& a, const SurfacePoint& b) {
  return (surface.Evaluate(a).p - surface.Evaluate(b).p).norm();
}

}  // namespace

void FollowCharts(const Surface& tip, const Surface& object, const ContactCoordinates& measured,
                  ContactCoordinates* followed) {
  const int tip_chart = measured.alpha_f.chart;
  const int object_chart = measured.alpha_o.chart;
  if (followed->alpha_f.chart == tip_chart && followed->alpha_o.chart == object_chart) return;
  if (CalcDistance(tip, followed->alpha_f, measured.alpha_f) >= kStray) return;
  if (CalcDistance(object, followed->alpha_o, measured.alpha_o) >= kStray) return;
  *followed = ChangeCharts(tip, object, *followed, tip_chart, object_chart);
}

ContactDrift CalcContactDrift(const Surface& tip, const Surface& object, ContactCoordinates followed,
                              const ContactCoordinates& measured) {
  FollowCharts(tip, object, measured, &followed);
  return {.object = CalcDistance(object, followed.alpha_o, measured.alpha_o),
          .fingertip = CalcDistance(tip, followed.alpha_f, measured.alpha_f),
          .psi = std::abs(std::remainder(followed.psi - measured.psi, 2.0 * kPi))};
}

}  // namespace dexcheck
