#pragma once

#include <nlohmann/json.hpp>

#include "controller/common/types.h"

namespace dexcheck::cli {

using Json = nlohmann::ordered_json;

/// A matrix as a list of rows.
Json ToRows(const Eigen::Ref<const MatrixXd>& matrix);

/// A vector as a list.
Json ToList(const Eigen::Ref<const VectorXd>& vector);

}  // namespace dexcheck::cli
