#pragma once

#include <pybind11/pybind11.h>

#include <functional>

#include "controller/model/robot_model.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Calls back with the model that an argument is or names, and with what its file says.
using ModelFinder =
    std::function<void(const pybind11::object& model,
                       const std::function<void(const RobotModel&, const RobotDescription&)>& use)>;

/// Adds `judge` to the module and what it returns.
void AddJudge(pybind11::module_* module, const ModelFinder& with_model);

}  // namespace dexcheck
