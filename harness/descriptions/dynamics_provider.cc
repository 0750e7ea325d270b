#include "harness/descriptions/dynamics_provider.h"

namespace dexcheck {

bool MechanismProvider::HasValue(Term term) const {
  switch (term) {
    case Term::kMHat:
    case Term::kCHatV:
    case Term::kNo:
    case Term::kObjectKineticEnergy:
    case Term::kObjectPotentialEnergy:
      return has_object_;
    case Term::kObjectPose:
    case Term::kVBo:
    case Term::kMo:
    case Term::kCoXoDot:
      return has_object_ && has_coordinates_;
    default:
      return term < Term::kContactFrame || !contacts_.empty();
  }
}

bool MechanismProvider::ReadValues(Term term, Eigen::Ref<MatrixXd> out) const {
  const auto each_contact = [&](const auto& member) {
    for (size_t i = 0; i < contacts_.size(); ++i)
      out.col(static_cast<Eigen::Index>(i)) = (contacts_[i].*member).reshaped();
  };
  switch (term) {
    case Term::kKineticEnergy:
      out(0, 0) = energy_.kinetic;
      return true;
    case Term::kPotentialEnergy:
      out(0, 0) = energy_.potential;
      return true;
    case Term::kLinearMomentum:
      out = energy_.linear_momentum;
      return true;
    case Term::kAngularMomentum:
      out = energy_.angular_momentum;
      return true;
    case Term::kContactFrame:
      each_contact(&ContactValues::frame);
      return true;
    case Term::kG:
      each_contact(&ContactValues::G);
      return true;
    case Term::kJB:
      for (size_t i = 0; i < contacts_.size(); ++i) {
        const Eigen::Index n = contacts_[i].J_B.cols();
        out.middleCols(static_cast<Eigen::Index>(i) * n, n) = contacts_[i].J_B;
      }
      return true;
    case Term::kKappaDot:
      each_contact(&ContactValues::relative_twist);
      return true;
    case Term::kJBDotXi:
      each_contact(&ContactValues::J_B_dot_xi);
      return true;
    case Term::kGDotTV:
      each_contact(&ContactValues::G_dot_T_V);
      return true;
    case Term::kObjectPose:
      out = object_.pose.reshaped();
      return true;
    case Term::kVBo:
      out = object_.V_Bo;
      return true;
    case Term::kMHat:
      out = object_.M_hat.reshaped();
      return true;
    case Term::kCHatV:
      out = object_.C_hat_V;
      return true;
    case Term::kNo:
      out = object_.N_o;
      return true;
    case Term::kObjectKineticEnergy:
      out(0, 0) = object_.kinetic;
      return true;
    case Term::kObjectPotentialEnergy:
      out(0, 0) = object_.potential;
      return true;
    case Term::kMo:
      out = object_.M_o.reshaped();
      return true;
    case Term::kCoXoDot:
      out = object_.C_o_X_o_dot;
      return true;
    default:
      return false;
  }
}

}  // namespace dexcheck
