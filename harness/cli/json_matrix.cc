#include "harness/cli/json_matrix.h"

namespace dexcheck::cli {

Json ToRows(const Eigen::Ref<const MatrixXd>& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    rows.push_back(row);
  }
  return rows;
}

Json ToList(const Eigen::Ref<const VectorXd>& vector) {
  Json list = Json::array();
  for (const double value : vector) list.push_back(value);
  return list;
}

}  // namespace dexcheck::cli
