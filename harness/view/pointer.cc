#include "harness/view/pointer.h"

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
  SetRow(m, *frame.run, frame.row, data.get());
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

namespace {

constexpr double kTurn = 0.006;     // rad a pixel
constexpr double kZoom = 0.88;      // a notch
constexpr double kNearest = 0.1;    // m
constexpr double kFarthest = 30.0;  // m

}  // namespace

ObjectCamera::ObjectCamera(const FrameSource& source, int width, int height)
    : source_(source), width_(width), height_(height) {
  view_.azimuth = DegToRad(143.0);
  view_.elevation = DegToRad(-14.0);
  view_.distance = 2.3;
}

Vector3d ObjectCamera::FindObject(long row) {
  const ViewFrame frame = source_.Read(row);
  const mjModel& model = source_.model();
  const int body = mj_name2id(&model, mjOBJ_BODY, frame.run->object_body.c_str());
  if (body < 0) return Vector3d(model.stat.center);
  if (!data_) data_ = MakeData(model);
  SetRow(model, *frame.run, frame.row, data_.get());
  return BodyPose(*data_, body).translation();
}

void ObjectCamera::AimAt(long row) {
  followed_ = FindObject(row);
  view_.look_at = followed_ + Vector3d(-0.15, 0.05, 0.02);
}

void ObjectCamera::AimAtObject(long row) {
  followed_ = FindObject(row);
  view_.look_at = followed_;
  view_.distance = 0.4;
}

void ObjectCamera::Follow(long row, bool follow) {
  const Vector3d now = FindObject(row);
  if (follow) view_.look_at += now - followed_;
  followed_ = now;
}

void ObjectCamera::Turn(double x, double y) {
  view_.azimuth -= kTurn * x;
  view_.elevation = std::clamp(view_.elevation - kTurn * y, DegToRad(-89.0), DegToRad(80.0));
}

void ObjectCamera::Move(double x, double y) {
  const Vector3d right(std::sin(view_.azimuth), -std::cos(view_.azimuth), 0.0);
  view_.look_at += view_.distance / height_ * (-x * right + y * Vector3d::UnitZ());
}

void ObjectCamera::Zoom(double notches) {
  view_.distance = std::clamp(view_.distance * std::pow(kZoom, notches), kNearest, kFarthest);
}

Ray ObjectCamera::FindRay(double x, double y) const {
  const double half = 0.5 * height_;
  return CalcRay(view_, DegToRad(source_.model().vis.global.fovy), (x - 0.5 * width_) / half,
                 (half - y) / half);
}

}  // namespace dexcheck
