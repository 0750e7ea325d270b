#include "harness/descriptions/dynamics_provider.h"

#include <algorithm>

namespace dexcheck {

bool MechanismProvider::HasValue(Term term) const {
  if (term < Term::kContactFrame) return true;
  if (term < Term::kObjectPose) return !contacts_.empty();
  constexpr Term kByCoordinates[] = {Term::kObjectPose, Term::kVBo, Term::kMo, Term::kCoXoDot};
  const bool needs_coordinates = std::ranges::find(kByCoordinates, term) != std::end(kByCoordinates);
  return has_object_ && (has_coordinates_ || !needs_coordinates);
}

void MechanismProvider::ReadValues(Term term, Eigen::Ref<MatrixXd> out) const {
  const auto put = [&](const auto& values) { std::copy_n(values.data(), values.size(), out.data()); };
  const auto put_number = [&](double value) { out(0, 0) = value; };
  const auto put_each = [&](const auto& member) {
    for (size_t i = 0; i < contacts_.size(); ++i) {
      const auto& values = contacts_[i].*member;
      std::copy_n(values.data(), values.size(), out.col(static_cast<Eigen::Index>(i)).data());
    }
  };
  switch (term) {
    case Term::kKineticEnergy:
      return put_number(energy_.kinetic);
    case Term::kPotentialEnergy:
      return put_number(energy_.potential);
    case Term::kLinearMomentum:
      return put(energy_.linear_momentum);
    case Term::kAngularMomentum:
      return put(energy_.angular_momentum);
    case Term::kContactFrame:
      return put_each(&ContactValues::frame);
    case Term::kG:
      return put_each(&ContactValues::G);
    case Term::kJB:
      for (size_t i = 0; i < contacts_.size(); ++i)
        out.middleCols(static_cast<Eigen::Index>(i) * contacts_[i].J_B.cols(), contacts_[i].J_B.cols()) =
            contacts_[i].J_B;
      return;
    case Term::kKappaDot:
      return put_each(&ContactValues::relative_twist);
    case Term::kJBDotXi:
      return put_each(&ContactValues::J_B_dot_xi);
    case Term::kGDotTV:
      return put_each(&ContactValues::G_dot_T_V);
    case Term::kObjectPose:
      return put(object_.pose);
    case Term::kVBo:
      return put(object_.V_Bo);
    case Term::kMHat:
      return put(object_.M_hat);
    case Term::kCHatV:
      return put(object_.C_hat_V);
    case Term::kNo:
      return put(object_.N_o);
    case Term::kObjectKineticEnergy:
      return put_number(object_.kinetic);
    case Term::kObjectPotentialEnergy:
      return put_number(object_.potential);
    case Term::kMo:
      return put(object_.M_o);
    case Term::kCoXoDot:
      return put(object_.C_o_X_o_dot);
    default:
      return;
  }
}

}  // namespace dexcheck
