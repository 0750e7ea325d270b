#include "harness/view/object_camera.h"

#include <algorithm>
#include <cmath>

#include "renders/run_decorations.h"

namespace dexcheck {
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
  const int body = mj_name2id(&model, mjOBJ_BODY, frame.frame.object_body.c_str());
  if (body < 0) return Vector3d(model.stat.center);
  if (!data_) data_ = MakeData(model);
  SetRow(model, frame.frame, 0, data_.get());
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
