#include "harness/descriptions/term_results.h"

namespace dexcheck {

Eigen::Map<const MatrixXd> TermResults::Find(Term term) const {
  const auto find = [](const auto& values) {
    return Eigen::Map<const MatrixXd>(values.data(), values.rows(), values.cols());
  };
  const auto find_number = [](const std::optional<double>& value) {
    return Eigen::Map<const MatrixXd>(value ? &*value : nullptr, value ? 1 : 0, value ? 1 : 0);
  };
  switch (term) {
    case Term::kMBar:
      return find(M);
    case Term::kCBarXi:
      return find(coriolis);
    case Term::kGravity:
      return find(gravity);
    case Term::kBias:
      return find(bias);
    case Term::kFriction:
      return find(friction);
    case Term::kKineticEnergy:
      return find_number(kinetic);
    case Term::kPotentialEnergy:
      return find_number(potential);
    default:
      return find_number(std::nullopt);
  }
}

}  // namespace dexcheck
