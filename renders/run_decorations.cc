#include "renders/run_decorations.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "renders/canvas.h"

namespace dexcheck {
namespace {

const Color kForce = MakeColor(0xe0102e);
const Color kCone = MakeColor(0x2fb7ff, 0.30F);
const Color kTrack = MakeColor(0x7a1fd0);
const Color kActual = MakeColor(0xff8a1f);
const Color kDesired = MakeColor(0x18c8e8, 0.25F);

// Sizes that suit a hand, m.
constexpr double kLongestForce = 0.042;
constexpr double kConeHeight = 0.026;
constexpr double kForceRadius = 0.0018;
constexpr double kTrackRadius = 0.0008;
constexpr double kActualRadius = 0.0022;
constexpr double kDesiredRadius = 0.0036;

// Points of a path or track are at least so far apart, m.
constexpr double kPathSpacing = 0.005;
constexpr double kTrackSpacing = 0.0002;

constexpr long kMostSamples = 500;

/// Adds a point unless it is too near to the last one.
void Extend(const Vector3d& p, double spacing, std::vector<Vector3d>* points) {
  if (points->empty() || (p - points->back()).norm() >= spacing) points->push_back(p);
}

Vector3d ContactVector(const RowMatrixXd& rows, long row, long contact) {
  return rows.block<1, 3>(row, 3 * contact).transpose();
}

/// Adds the contact forces of a row, each in its friction cone.
void AddForces(const RunFrames& run, long row, double meters_per_newton,
               std::vector<Decoration>* decorations) {
  if (run.contact_forces.size() == 0) return;
  for (long k = 0; k < run.contacts(); ++k) {
    const Vector3d p = ContactVector(run.contact_positions, row, k);
    const Vector3d force = ContactVector(run.contact_forces, row, k);
    if (!p.allFinite() || !force.allFinite() || force.isZero()) continue;
    decorations->emplace_back(Arrow{p, p + meters_per_newton * force, kForceRadius, kForce});
    if (run.contact_normals.size() == 0 || !(run.friction > 0.0)) continue;
    const Vector3d normal = ContactVector(run.contact_normals, row, k);
    if (!normal.allFinite() || normal.isZero()) continue;
    decorations->emplace_back(Cone{p, normal.normalized(), kConeHeight, std::atan(run.friction), kCone});
  }
}

}  // namespace

Pose BodyPose(const mjData& data, int body) {
  Pose X = Pose::Identity();
  X.translation() = Eigen::Map<const Vector3d>(data.xpos + 3 * body);
  X.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.xmat + 9 * body);
  return X;
}

void SetRow(const mjModel& model, const RunFrames& run, long row, mjData* data) {
  mju_copy(data->qpos, run.qpos.row(row).data(), static_cast<int>(model.nq));
  mj_kinematics(&model, data);
  mj_comPos(&model, data);
  mj_camlight(&model, data);
}

double CalcMetersPerNewton(const RunFrames& run) {
  double largest = 0.0;
  for (long row = 0; row < run.contact_forces.rows(); ++row) {
    for (long k = 0; k < run.contact_forces.cols() / 3; ++k) {
      const double size = ContactVector(run.contact_forces, row, k).norm();
      if (std::isfinite(size)) largest = std::max(largest, size);
    }
  }
  return largest > 0.0 ? kLongestForce / largest : 1.0;
}

RunDecorator::RunDecorator(const mjModel& model, const RunFrames& run, const DecorationOptions& options,
                           mjData* data)
    : run_(run),
      options_(options),
      object_(mj_name2id(&model, mjOBJ_BODY, run.object_body.c_str())),
      meters_per_newton_(CalcMetersPerNewton(run)) {
  // A robot that holds nothing leaves no tracks.
  if (run.object_body.empty()) options_.tracks = false;
  if (options_.tracks && object_ < 0) {
    throw InputError(run.source + ": object: no body " + Quote(run.object_body) + " in the model");
  }
  if (!options_.tracks) return;
  const long stride = (run.rows() + kMostSamples - 1) / kMostSamples;
  for (long row = 0; row < run.rows(); row += stride) {
    SetRow(model, run, row, data);
    sampled_.push_back(row);
    poses_.push_back(BodyPose(*data, object_));
  }
}

std::vector<Decoration> RunDecorator::Make(long row, const mjData& data) const {
  std::vector<Decoration> decorations;
  if (options_.forces) AddForces(run_, row, meters_per_newton_, &decorations);
  if (options_.tracks) {
    const Pose X_WO = BodyPose(data, object_);
    AddTracks(row, X_WO, &decorations);
    AddPaths(row, X_WO.translation(), &decorations);
  }
  return decorations;
}

void RunDecorator::AddTracks(long row, const Pose& X_WO, std::vector<Decoration>* decorations) const {
  for (long k = 0; k < run_.contacts(); ++k) {
    Polyline track{{}, kTrackRadius, kTrack};
    const auto finish = [&] {
      if (track.points.size() > 1) decorations->emplace_back(track);
      track.points.clear();
    };
    for (size_t i = 0; i < sampled_.size() && sampled_[i] <= row; ++i) {
      const Vector3d p = ContactVector(run_.contact_positions, sampled_[i], k);
      if (!p.allFinite()) {
        finish();
        continue;
      }
      Extend(X_WO * (poses_[i].inverse() * p), kTrackSpacing, &track.points);
    }
    finish();
  }
}

void RunDecorator::AddPaths(long row, const Vector3d& p_WO, std::vector<Decoration>* decorations) const {
  Polyline actual{{}, kActualRadius, kActual};
  Polyline desired{{}, kDesiredRadius, kDesired};
  for (size_t i = 0; i < sampled_.size(); ++i) {
    if (sampled_[i] <= row) Extend(poses_[i].translation(), kPathSpacing, &actual.points);
    if (run_.desired_positions.size() > 0) {
      const Vector3d p = run_.desired_positions.row(sampled_[i]).transpose();
      if (p.allFinite()) Extend(p, kPathSpacing, &desired.points);
    }
  }
  actual.points.push_back(p_WO);
  decorations->emplace_back(std::move(actual));
  decorations->emplace_back(std::move(desired));
}

std::vector<LegendEntry> RunDecorator::MakeLegend() const {
  std::vector<LegendEntry> legend;
  const auto add = [&](const char* text, const Color& color) {
    legend.push_back({text, {color[0], color[1], color[2], 1.0F}});
  };
  if (options_.forces && run_.contact_forces.size() > 0) {
    add("force on the object", kForce);
    if (run_.friction > 0.0) add("friction cone", kCone);
  }
  if (options_.tracks) {
    if (run_.contacts() > 0) add("contact tracks", kTrack);
    if (run_.desired_positions.size() > 0) add("desired path", kDesired);
    add("actual path", kActual);
  }
  return legend;
}

}  // namespace dexcheck
