#include "controller/contact/contact_model.h"

#include <array>
#include <cmath>

#include "controller/common/errors.h"

namespace dexcheck {

std::span<const int> ListTransmittedRows(ContactType type) {
  static constexpr std::array<int, 1> kFrictionlessRows = {2};
  static constexpr std::array<int, 3> kHardFingerRows = {0, 1, 2};
  static constexpr std::array<int, 4> kSoftFingerRows = {0, 1, 2, 5};
  switch (type) {
    case ContactType::kFrictionless:
      return kFrictionlessRows;
    case ContactType::kHardFinger:
      return kHardFingerRows;
    case ContactType::kSoftFinger:
      return kSoftFingerRows;
  }
  Require(false, "contact type", "must be one of ContactType", static_cast<int>(type));
  return {};
}

int CountForces(ContactType type) { return static_cast<int>(ListTransmittedRows(type).size()); }

Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 4> CalcWrenchBasis(ContactType type) {
  const std::span<const int> rows = ListTransmittedRows(type);
  Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 4> B_c;
  B_c.setZero(6, static_cast<Eigen::Index>(rows.size()));
  Eigen::Index column = 0;
  for (const int row : rows) B_c(row, column++) = 1.0;
  return B_c;
}

double CalcConeMargin(ContactType type, const ContactFriction& friction,
                      const Eigen::Ref<const VectorXd>& f_c) {
  Require(f_c.size() == CountForces(type), "length of f_c", "must be that of the contact type",
          static_cast<double>(f_c.size()));
  if (type == ContactType::kFrictionless) return f_c(0);
  Require(std::isfinite(friction.mu) && friction.mu > 0.0, "mu", "must be positive", friction.mu);
  const double tangential = std::hypot(f_c(0), f_c(1)) / friction.mu;
  if (type == ContactType::kHardFinger) return f_c(2) - tangential;
  Require(std::isfinite(friction.gamma) && friction.gamma > 0.0, "gamma [m]", "must be positive",
          friction.gamma);
  return f_c(2) - std::hypot(tangential, f_c(3) / friction.gamma);
}

}  // namespace dexcheck
