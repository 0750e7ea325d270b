#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "controller/model/parameter_reader.h"
#include "harness/comparison/consistency.h"
#include "harness/comparison/engine_constants.h"

namespace dexcheck::testing {

/// The names of the checks that failed, each followed by a space. All terms must have been compared.
inline std::string ListFailures(const ConsistencyResult& result) {
  EXPECT_GE(result.terms.size(), 11U);  // as many has a body that floats alone
  std::string failures;
  for (const auto* records : {&result.constants.records, &result.terms}) {
    for (const CheckRecord& record : *records) {
      if (record.failed) failures += record.name + " ";
    }
  }
  return failures;
}

/// Compares a description with an engine's model. @param notes receives what is not compared, unless null.
inline std::string CompareWithEngine(const RobotDescription& robot, const mjModel& engine, long samples = 20,
                                     std::vector<std::string>* notes = nullptr) {
  const RobotModel model(robot.spec);
  const Adapter adapter(model, engine, "robot.xml");
  ConsistencyOptions options;
  options.samples = samples;
  ConsistencyResult result = CheckConsistency(adapter, options, [](long) { return true; });
  result.constants = CheckConstants(adapter, ListEngineParts(adapter, {false, true}), {true});
  if (notes != nullptr) *notes = result.constants.not_compared;
  return ListFailures(result);
}

/// Compares two descriptions as CompleteEachOther left them, at random states.
inline ConsistencyResult CompareDescriptions(const RobotDescription& a, const RobotDescription& b,
                                             const ConsistencyOptions& options) {
  const RobotModel model_a(a.spec), model_b(b.spec);
  AnalyticProvider first(model_a, a.spec.source), second(model_b, b.spec.source, model_a);
  ConsistencyResult result = CompareTerms(model_a, &first, &second, options, [](long) { return true; });
  result.constants = CheckConstants(a, b);
  return result;
}

/// A parameter file's text as a description, without its parts.
inline RobotDescription ReadTable(const std::string& text, const std::string& source = "robot.toml") {
  RobotDescription table;
  table.spec = ParseRobotModel(text, source).spec();
  table.joints.resize(table.spec.joints.size());
  return table;
}

}  // namespace dexcheck::testing
