#include "harness/engine/contact_softness.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

#include "controller/common/linear_algebra.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

constexpr double kClosed = 1e-4;   // m
constexpr double kRigid = 1e-6;    // of a row's R: as good as rigid
constexpr double kNothing = 1e-9;  // of the largest eigenvalue: zero but for rounding

/// A row of the engine's constraints.
struct Row {
  int index;
  bool tangential, of_object;
};

std::vector<Row> ListRows(const mjModel& m, const mjData& d, int object) {
  std::vector<Row> rows;
  for (int i = 0; i < d.nefc; ++i) {
    // Bonds hold the object; casters have no friction.
    if (d.efc_type[i] == mjCNSTR_EQUALITY) rows.push_back({i, false, true});
    if (d.efc_type[i] == mjCNSTR_CONTACT_FRICTIONLESS) rows.push_back({i, false, false});
  }
  for (int k = 0; k < d.ncon; ++k) {
    const mjContact& c = d.contact[k];
    if (c.efc_address < 0 || d.efc_type[c.efc_address] != mjCNSTR_CONTACT_ELLIPTIC) continue;
    const bool of_object = m.geom_bodyid[c.geom1] == object || m.geom_bodyid[c.geom2] == object;
    for (int j = 0; j < c.dim; ++j) rows.push_back({c.efc_address + j, j > 0, of_object});
  }
  return rows;
}

Eigen::RowVectorXd ReadRow(const mjModel& m, const mjData& d, int row) {
  if (mj_isSparse(&m) == 0) {
    return Eigen::Map<const Eigen::RowVectorXd>(d.efc_J + static_cast<ptrdiff_t>(row) * m.nv, m.nv);
  }
  Eigen::RowVectorXd values = Eigen::RowVectorXd::Zero(m.nv);
  for (int i = 0; i < d.efc_J_rownnz[row]; ++i) {
    const int at = d.efc_J_rowadr[row] + i;
    values[d.efc_J_colind[at]] = d.efc_J[at];
  }
  return values;
}

double FindFraction(const MatrixXd& A, const VectorXd& R) {
  const VectorXd scale = R.cwiseSqrt().cwiseInverse();
  const MatrixXd S = scale.asDiagonal() * A * scale.asDiagonal();
  const VectorXd values = CalcSymmetricEigenvalues(S);
  for (const double value : values) {
    if (value > kNothing * values.maxCoeff()) return 1.0 / (1.0 + value);
  }
  return 0.0;
}

}  // namespace

ContactSoftness FindContactSoftness(const Adapter& adapter, const Eigen::Ref<const VectorXd>& q,
                                    const Pose& X_Bo) {
  const MjModelPtr model(mj_copyModel(nullptr, &adapter.engine()));
  std::fill_n(model->pair_margin, model->npair, kClosed);
  std::fill_n(model->geom_margin, model->ngeom, kClosed);
  const MjDataPtr data = MakeData(*model);
  adapter.SetPositions(q, data->qpos);
  if (adapter.object_body() >= 0) WriteFreePose(X_Bo, data->qpos + adapter.object_qpos());
  mj_fwdPosition(model.get(), data.get());
  const std::vector<Row> rows = ListRows(*model, *data, adapter.object_body());
  if (rows.empty()) return {};

  const auto nv = static_cast<Eigen::Index>(model->nv);
  const auto count = static_cast<Eigen::Index>(rows.size());
  RowMatrixXd M(nv, nv);
  ExpandMass(*model, *data, M.data());
  MatrixXd J(count, nv);
  VectorXd R(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    J.row(i) = ReadRow(*model, *data, rows[static_cast<size_t>(i)].index);
    R[i] = data->efc_R[rows[static_cast<size_t>(i)].index];
  }
  const MatrixXd A = J * M.llt().solve(J.transpose());
  // With the rows rigid that are not chosen.
  const auto fraction = [&](bool tangential, bool of_object) {
    VectorXd chosen = R;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Row& row = rows[static_cast<size_t>(i)];
      if ((tangential && !row.tangential) || (of_object && !row.of_object)) chosen[i] *= kRigid;
    }
    return FindFraction(A, chosen);
  };
  return {fraction(false, false), fraction(true, false), fraction(false, true), fraction(true, true)};
}

}  // namespace dexcheck
