#include "harness/view/mouse_force.h"

#include <algorithm>
#include <cmath>

#include "harness/engine/mujoco_release.h"
#include "renders/run_decorations.h"

namespace dexcheck {
namespace {

/// A body is pulled with three times its weight when the mouse is a metre away, and light ones with 10 N.
constexpr double kWeights = 30.0;      // N/m for each kg
constexpr double kLeastSpring = 10.0;  // N/m

/// The link that an engine's body moves with, or the object; none for anything else.
std::optional<int> FindLink(const Setup& setup, int body) {
  const mjModel& m = setup.engine();
  const int root = m.body_weldid[body];
  const int object = setup.adapter().object_body();
  if (object >= 0 && m.body_weldid[object] == root) return Wrench::kObject;
  const std::vector<int>& links = setup.adapter().link_bodies();
  for (size_t i = 0; i < links.size(); ++i) {
    if (links[i] > 0 && m.body_weldid[links[i]] == root) return static_cast<int>(i) - 1;
  }
  return std::nullopt;
}

}  // namespace

Ray CalcRay(const Viewpoint& view, double fovy, double x, double y) {
  const Vector3d forward(std::cos(view.elevation) * std::cos(view.azimuth),
                         std::cos(view.elevation) * std::sin(view.azimuth), std::sin(view.elevation));
  const Vector3d right(std::sin(view.azimuth), -std::cos(view.azimuth), 0.0);
  const Vector3d up = right.cross(forward);
  const double slope = std::tan(0.5 * fovy);
  return {view.look_at - view.distance * forward, (forward + slope * (x * right + y * up)).normalized()};
}

std::optional<MouseSpring> MouseSpring::Grab(const Setup& setup, const mjModel& looks, const ViewFrame& frame,
                                             const Ray& ray) {
  const mjModel& m = looks;
  const MjDataPtr data = MakeData(m);
  SetRow(m, frame.frame, 0, data.get());
  int geom = -1;
  const mjtByte groups[mjNGROUP] = {1, 1, 1, 0, 0, 0};
  const double distance = CastRay(m, *data, ray.from.data(), ray.along.data(), groups, &geom);
  if (geom < 0 || distance < 0.0) return std::nullopt;
  const std::optional<int> link = FindLink(setup, m.geom_bodyid[geom]);
  if (!link) return std::nullopt;
  const double mass = m.body_mass[m.body_weldid[m.geom_bodyid[geom]]];
  MouseSpring spring(setup, *link, Vector3d::Zero(), std::max(kWeights * mass, kLeastSpring));
  spring.at_ = spring.FindPose(frame).inverse() * Vector3d(ray.from + distance * ray.along);
  return spring;
}

Pose MouseSpring::FindPose(const ViewFrame& frame) const {
  if (link_ == Wrench::kObject) return frame.X_Bo;
  ModelTerms robot(setup_->model());
  robot.SetState(frame.q, VectorXd::Zero(setup_->model().num_velocities()));
  return robot.CalcLinkPose(link_);
}

Vector3d MouseSpring::FindPoint(const ViewFrame& frame) const { return FindPose(frame) * at_; }

MouseForce MouseSpring::Find(const ViewFrame& frame, const Ray& ray) const {
  const Vector3d point = FindPoint(frame);
  // Towards the place on the ray that is nearest.
  const Vector3d target = ray.from + ray.along.dot(point - ray.from) * ray.along;
  MouseForce force;
  force.body = link_ == Wrench::kObject ? "object" : setup_->model().link_name(link_);
  force.at = at_;
  force.force = stiffness_ * (target - point);
  return force;
}

}  // namespace dexcheck
