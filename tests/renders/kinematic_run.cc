#include "tests/renders/kinematic_run.h"

#include <array>
#include <cmath>

#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "renders/viewpoint.h"

namespace dexcheck::testing {
namespace {

constexpr double kSpeed = 1.0;        // m/s
constexpr double kWheelRadius = 0.1;  // m

int JointAddress(const mjModel& model, const char* name) {
  return model.jnt_qposadr[mj_name2id(&model, mjOBJ_JOINT, name)];
}

CheckSeries MakeCheck(const char* name, CheckCategory kind, double bound, double level,
                      const RunFrames& run) {
  CheckSeries check{name, kind, bound, {}};
  for (const double time : run.times) check.residuals.push_back(level * (1.0 + 0.5 * std::sin(3.0 * time)));
  return check;
}

}  // namespace

RunFrames MakeKinematicRun(const mjModel& model, double duration, double step) {
  RunFrames run;
  run.source = "kinematic run";
  run.title = "kinematic";
  run.object_body = "torus";
  run.friction = 0.8;
  const auto n = static_cast<long>(std::lround(duration / step)) + 1;
  const double* ready = model.key_qpos + model.nq * mj_name2id(&model, mjOBJ_KEY, "grasp_ready");
  const int base = JointAddress(model, "base");
  const int torus = JointAddress(model, "torus_free");
  run.qpos.resize(n, model.nq);
  run.desired_positions.resize(n, 3);
  for (long row = 0; row < n; ++row) {
    const double time = step * static_cast<double>(row);
    run.times.push_back(time);
    run.qpos.row(row) = Eigen::Map<const Eigen::RowVectorXd>(ready, model.nq);
    run.qpos(row, base) += kSpeed * time;
    run.qpos(row, torus) += kSpeed * time;
    for (const char* wheel : {"wheel_left", "wheel_right"}) {
      run.qpos(row, JointAddress(model, wheel)) = kSpeed * time / kWheelRadius;
    }
    run.desired_positions.row(row) = run.qpos.block<1, 3>(row, torus);
    run.position_errors.push_back(2e-8 * (1.05 + std::sin(4.0 * time)) * std::exp(-0.3 * time));
    run.orientation_errors.push_back(3e-7 * (1.05 + std::cos(3.0 * time)));
  }
  run.checks = {MakeCheck("M_bar", CheckCategory::kModel, 1e-10, 2e-13, run),
                MakeCheck("acceleration", CheckCategory::kInverseDynamics, 1e-9, 3e-11, run),
                MakeCheck("contact_force", CheckCategory::kForwardDynamics, 1e-6, 7e-8, run),
                MakeCheck("wheel_slip", CheckCategory::kAssumption, 1e-3, 4e-6, run)};

  const MjDataPtr data = MakeData(model);
  SetRow(model, run, 0, data.get());
  constexpr std::array<const char*, 4> kTips = {"rf1_tip_geom", "rf2_tip_geom", "rf3_tip_geom",
                                                "rf4_tip_geom"};
  constexpr long kColumns = 3 * static_cast<long>(kTips.size());
  run.contact_positions.resize(n, kColumns);
  run.contact_forces.resize(n, kColumns);
  run.contact_normals.resize(n, kColumns);
  const Pose X_WO = BodyPose(*data, mj_name2id(&model, mjOBJ_BODY, "torus"));
  for (size_t k = 0; k < kTips.size(); ++k) {
    const int tip = mj_name2id(&model, mjOBJ_GEOM, kTips[k]);
    const Vector3d center(data->geom_xpos + 3 * tip);
    // The fingertips touch the outer equator, so the normals go through the torus's centre.
    Vector3d normal = X_WO.inverse() * center;
    normal.z() = 0.0;
    normal = -(X_WO.linear() * normal).normalized();
    const Vector3d contact = center + model.geom_size[3 * tip] * normal;
    const double squeeze = k == 3 ? 4.0 : 1.6;
    for (long row = 0; row < n; ++row) {
      const double time = run.times[static_cast<size_t>(row)];
      const Vector3d moved = contact + kSpeed * time * Vector3d::UnitX();
      const Vector3d force = squeeze * normal + 0.6 * Vector3d(std::sin(2.0 * time), 0.0, 0.8);
      run.contact_positions.block<1, 3>(row, 3 * static_cast<long>(k)) = moved.transpose();
      run.contact_forces.block<1, 3>(row, 3 * static_cast<long>(k)) = force.transpose();
      run.contact_normals.block<1, 3>(row, 3 * static_cast<long>(k)) = normal.transpose();
    }
  }
  return run;
}

Vector3d FindTorus(const Image& image) {
  Vector3d sum = Vector3d::Zero();
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* const rgb = image.Pixel(x, y);
      if (rgb[0] > 90 && rgb[0] > 1.5 * rgb[1] && rgb[0] > 2.2 * rgb[2])
        sum += Vector3d(x + 0.5, y + 0.5, 1.0);
    }
  }
  return {sum.x() / sum.z(), sum.y() / sum.z(), sum.z()};
}

}  // namespace dexcheck::testing
