#pragma once

#include <pybind11/pybind11.h>

#include <functional>

#include "controller/model/robot_model.h"

namespace dexcheck {

/// Calls back with the model that an argument is or names.
using ModelFinder =
    std::function<void(const pybind11::object& model, const std::function<void(const RobotModel&)>& use)>;

/// Adds `judge` to the module and what it returns.
void AddJudge(pybind11::module_* module, const ModelFinder& with_model);

}  // namespace dexcheck
