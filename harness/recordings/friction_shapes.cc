#include "harness/recordings/friction_shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dexcheck {

MatrixXd ListShapeVelocities(const VectorXd& speeds, const std::map<int, double>& stribeck,
                             const std::map<int, double>& smooth) {
  constexpr double kSmooth[] = {0.03, 0.1, 0.3, 1.0}, kSlowest = 0.05, kRatio = 1.8;
  MatrixXd velocities = MatrixXd::Zero(speeds.size(), kFrictionShapes);
  for (int joint = 0; joint < speeds.size(); ++joint) {
    const double speed = std::max(speeds[joint], std::numeric_limits<double>::min());
    const auto fill = [&](int first, int count, const std::map<int, double>& known, const auto& usual) {
      const auto own = known.find(joint);
      for (int i = 0; i < count; ++i)
        velocities(joint, first + i) =
            own == known.end() ? usual(i) * speed : own->second * std::pow(kFineRatio, i - 0.5);
    };
    fill(1, kSmoothShapes, smooth, [&](int i) { return kSmooth[i]; });
    fill(1 + kSmoothShapes, kStribeckShapes, stribeck, [](int i) { return kSlowest * std::pow(kRatio, i); });
  }
  return velocities;
}

FrictionRow CalcFrictionShapes(double velocity, const FrictionRow& shape_velocities) {
  const double sign = velocity > 0.0 ? 1.0 : velocity < 0.0 ? -1.0 : 0.0;
  FrictionRow shapes;
  shapes[kSlipShape] = sign;
  for (int i = 1; i < kFrictionShapes; ++i) {
    const double u = velocity / shape_velocities[i];
    shapes[i] = i <= kSmoothShapes ? std::tanh(u) : sign * std::exp(-u * u);
  }
  return shapes;
}

double CalcSlip(double sign, double before, double moved) {
  // Over which a recorded Panda's friction builds up (marcocognetti/FrankaEmikaPandaDynModel).
  constexpr double kDistance = 2e-3;
  return sign + (before - sign) * std::exp(-moved / kDistance);
}

}  // namespace dexcheck
