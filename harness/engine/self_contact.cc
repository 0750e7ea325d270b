#include "harness/engine/self_contact.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {

SelfContact::SelfContact(MjModelPtr model, const std::string& source, const std::vector<std::string>& joints,
                         const VectorXd& usual)
    : model_(std::move(model)), data_(MakeData(*model_)) {
  for (const std::string& name : joints) {
    const int joint = FindByName(*model_, mjOBJ_JOINT, name);
    const bool is_single =
        joint >= 0 && (model_->jnt_type[joint] == mjJNT_HINGE || model_->jnt_type[joint] == mjJNT_SLIDE);
    if (!is_single) throw InputError(source + ": must have a hinge or slide joint " + Quote(name));
    addresses_.push_back(model_->jnt_qposadr[joint]);
  }
  Place(usual);
  for (int i = 0; i < data_->ncon; ++i) usual_.push_back(BodiesOf(data_->contact[i]));
}

double SelfContact::CalcDepth(const VectorXd& q) {
  Place(q);
  double depth = 0.0;
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    if (std::ranges::find(usual_, BodiesOf(contact)) == usual_.end()) depth += std::max(0.0, -contact.dist);
  }
  return depth;
}

void SelfContact::Place(const VectorXd& q) {
  for (size_t i = 0; i < addresses_.size(); ++i) data_->qpos[addresses_[i]] = q[static_cast<Eigen::Index>(i)];
  mj_kinematics(model_.get(), data_.get());
  mj_comPos(model_.get(), data_.get());
  mj_collision(model_.get(), data_.get());
}

std::pair<int, int> SelfContact::BodiesOf(const mjContact& contact) const {
  return std::minmax({model_->geom_bodyid[contact.geom1], model_->geom_bodyid[contact.geom2]});
}

}  // namespace dexcheck
