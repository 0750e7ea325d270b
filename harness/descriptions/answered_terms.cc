#include "harness/descriptions/answered_terms.h"

namespace dexcheck {

bool AnsweredTerms::Has(Term term) const {
  switch (term) {
    case Term::kMBar:
      return M.size() > 0;
    case Term::kCBarXi:
      return coriolis.size() > 0;
    case Term::kGravity:
      return gravity.size() > 0;
    case Term::kBias:
      return bias.size() > 0;
    case Term::kFriction:
      return friction.size() > 0;
    case Term::kKineticEnergy:
      return kinetic.has_value();
    case Term::kPotentialEnergy:
      return potential.has_value();
    default:
      return false;
  }
}

void AnsweredTerms::Read(Term term, Eigen::Ref<MatrixXd> out) const {
  switch (term) {
    case Term::kMBar:
      out = M;
      break;
    case Term::kCBarXi:
      out = coriolis;
      break;
    case Term::kGravity:
      out = gravity;
      break;
    case Term::kBias:
      out = bias;
      break;
    case Term::kFriction:
      out = friction;
      break;
    case Term::kKineticEnergy:
      out(0, 0) = *kinetic;
      break;
    case Term::kPotentialEnergy:
      out(0, 0) = *potential;
      break;
    default:
      break;
  }
}

}  // namespace dexcheck
