#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck::cli {

using Json = nlohmann::ordered_json;

/// A vector as a list.
inline Json ToList(const Eigen::Ref<const VectorXd>& vector) {
  return std::vector<double>(vector.begin(), vector.end());
}

/// A matrix as a list of rows.
inline Json ToRows(const Eigen::Ref<const MatrixXd>& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) rows.push_back(ToList(matrix.row(i).transpose()));
  return rows;
}

}  // namespace dexcheck::cli
