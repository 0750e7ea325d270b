#include "harness/diagnosis/step_forces.h"

#include <cmath>
#include <limits>
#include <utility>

namespace dexcheck {
namespace {

using Eigen::Index;

RobotModel AddBodyFrames(const RobotModel& model) {
  RobotSpec spec = model.spec();
  for (int link = -1; link < model.num_joints(); ++link) {
    Frame frame;
    frame.name = "centre of mass of " + model.link_name(link);
    frame.link = link;
    frame.X_LF.translation() =
        link < 0 ? model.base_with_wheels().com : model.joints()[static_cast<size_t>(link)].body.com;
    spec.frames.push_back(frame);
  }
  return RobotModel(std::move(spec));
}

}  // namespace

StepForces::StepForces(const StepStore& store)
    : store_(store),
      model_(AddBodyFrames(store.moving_model())),
      terms_(model_),
      n_(model_.num_velocities()),
      rows_(store.Get(StepStore::kResidual).rows()),
      first_link_(model_.base().type == BaseType::kFixed ? 0 : -1),
      wheels_(model_.num_joints() - store.setup().model().num_joints()),
      dry_(store.setup().model().num_base_velocities() - wheels_),
      gravity_(model_.gravity()) {
  for (int link = first_link_; link < model_.num_joints(); ++link) {
    const MassProperties& body =
        link < 0 ? model_.base_with_wheels() : model_.joints()[static_cast<size_t>(link)].body;
    links_.push_back({Matrix6Xd::Zero(6, n_), Matrix6Xd::Zero(6, n_), Pose::Identity(), &body});
    mass_ += body.mass;
  }
  if (store.setup().has_object()) mass_ += store.setup().declared_object().body.mass;
  constexpr double kEarth = 10.0;  // m/s^2
  weight_ = kEarth * mass_;
}

bool StepForces::SetGravity(const Vector3d& gravity) {
  constexpr double kSame = 1e-9;
  const double change = (std::exchange(gravity_, gravity) - gravity).norm();
  return change > kSame * gravity.norm();
}

void StepForces::SetStep(const Eigen::Ref<const VectorXd>& row) {
  row_ = row;
  terms_.SetState(Now(StepStore::kMotionPosition), Now(StepStore::kMotionVelocity));
  noise_ = store_.CalcNoise(row_);
  const int first_frame = static_cast<int>(model_.frames().size() - links_.size());
  for (size_t i = 0; i < links_.size(); ++i) {
    const int frame = first_frame + static_cast<int>(i);
    terms_.CalcFrameJacobian(frame, links_[i].J, links_[i].J_dot);
    links_[i].X = terms_.CalcFramePose(frame);
    for (size_t k = 0; k < i; ++k)
      reach_ = std::max(reach_, (links_[i].X.translation() - links_[k].X.translation()).norm());
  }
}

Turns StepForces::ListTurns() const {
  Turns turns;
  for (const Link& link : links_) turns.push_back(link.X.linear());
  turns.emplace_back(Now(StepStore::kObjectPose).head<9>().reshaped(3, 3));
  return turns;
}

}  // namespace dexcheck
