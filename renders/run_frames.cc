#include "renders/run_frames.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

long RunFrames::RowAt(double time) const {
  const auto after = std::ranges::upper_bound(times, time);
  return std::max(0L, static_cast<long>(after - times.begin()) - 1);
}

void CheckRunFrames(const mjModel& model, const RunFrames& run) {
  const auto fail = [&](const std::string& what) { throw InputError(run.source + ": " + what); };
  const long n = run.rows();
  if (n == 0) fail("time: the run has no recorded instants");
  for (long i = 0; i < n; ++i) {
    const double time = run.times[static_cast<size_t>(i)];
    if (!std::isfinite(time)) fail("time: row " + std::to_string(i) + " is not finite");
    if (i > 0 && !(time > run.times[static_cast<size_t>(i - 1)])) {
      fail("time: must increase, got " + FormatNumber(time) + " in row " + std::to_string(i));
    }
  }
  if (n == 1) fail("time: the run ends where it begins, at " + FormatNumber(run.times.front()) + " s");
  const auto check_size = [&](const std::string& key, long rows, long columns, long columns_expected) {
    if (rows == n && columns == columns_expected) return;
    fail(key + ": must be " + std::to_string(n) + " x " + std::to_string(columns_expected) + ", got " +
         std::to_string(rows) + " x " + std::to_string(columns));
  };
  const auto check_matrix = [&](const std::string& key, const RowMatrixXd& matrix, long columns) {
    if (matrix.size() > 0) check_size(key, matrix.rows(), matrix.cols(), columns);
  };
  const auto check_series = [&](const std::string& key, const std::vector<double>& series) {
    if (!series.empty()) check_size(key, static_cast<long>(series.size()), 1, 1);
  };
  check_size("qpos", run.qpos.rows(), run.qpos.cols(), model.nq);
  if (!run.qpos.allFinite()) fail("qpos: is not finite");
  check_series("position error", run.position_errors);
  check_series("orientation error", run.orientation_errors);
  check_series("joint error", run.joint_errors);
  for (const CheckSeries& check : run.checks) {
    check_size("check " + check.name, static_cast<long>(check.residuals.size()), 1, 1);
  }
  const long contact_columns = 3 * run.contacts();
  check_matrix("contact positions", run.contact_positions, contact_columns);
  check_matrix("contact forces", run.contact_forces, contact_columns);
  check_matrix("contact normals", run.contact_normals, contact_columns);
  check_matrix("desired positions", run.desired_positions, 3);
  check_matrix("desired angles", run.desired_angles, 3);
}

void SetRow(const mjModel& model, const RunFrames& run, long row, mjData* data) {
  mju_copy(data->qpos, run.qpos.row(row).data(), static_cast<int>(model.nq));
  mj_kinematics(&model, data);
  mj_comPos(&model, data);
  mj_camlight(&model, data);
}

Vector3d ContactVector(const RowMatrixXd& rows, long row, long contact) {
  return rows.block<1, 3>(row, 3 * contact).transpose();
}

double CalcMetersPerNewton(const RunFrames& run) {
  constexpr double kLongestForce = 0.042;  // m, suits a hand
  double largest = 0.0;
  for (long row = 0; row < run.contact_forces.rows(); ++row) {
    for (long k = 0; k < run.contact_forces.cols() / 3; ++k) {
      const double size = ContactVector(run.contact_forces, row, k).norm();
      if (std::isfinite(size)) largest = std::max(largest, size);
    }
  }
  return largest > 0.0 ? kLongestForce / largest : 1.0;
}

CheckHistory::CheckHistory(const RunFrames& run) : run_(run) {
  for (const CheckSeries& check : run.checks) {
    std::vector<double>& worst = worst_.emplace_back();
    worst.reserve(check.residuals.size());
    double largest = 0.0;
    for (const double residual : check.residuals) {
      largest = std::max(largest, std::abs(residual));
      if (std::isnan(residual)) largest = kInfinity;
      worst.push_back(largest);
    }
  }
}

std::vector<CategoryStatus> CheckHistory::ListCategories(long row) const {
  std::vector<CategoryStatus> categories;
  if (run_.checks.empty()) return categories;
  for (const CheckCategory kind : kCheckCategories) {
    CategoryStatus& status = categories.emplace_back(CategoryStatus{kind});
    for (size_t i = 0; i < worst_.size(); ++i) {
      const CheckSeries& check = run_.checks[i];
      if (check.kind != kind) continue;
      CheckRecord record{.name = check.name, .kind = kind, .bound = check.bound};
      record.Add(worst_[i][static_cast<size_t>(row)], 0.0);
      status.Add(record);
    }
  }
  return categories;
}

}  // namespace dexcheck
