#pragma once

// A robot whose specification agrees with the engine's model, for tests that make one of them wrong.

#include <random>
#include <utility>

#include "harness/diagnosis/diagnose.h"
#include "harness/engine/engine.h"
#include "tests/common/paper_robot.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing {

struct DiagnosedRobot {
  RobotSpec spec;
  MjModelPtr engine;
};

inline DiagnosedRobot LoadPanda() { return {ReadPanda().spec(), LoadMjcf(SourcePath("/mjcf/panda.xml"))}; }
inline DiagnosedRobot LoadPaperRobot() {
  return {ReadPaperRobot().spec(), LoadMjcf(SourcePath("/mjcf/scene.xml"))};
}
inline DiagnosedRobot MakeDiagnosedRobot(const RandomRobotOptions& options, std::mt19937* random) {
  RobotSpec spec = MakeRandomRobot(options, random);
  MjModelPtr engine = LoadMjcfText(WriteMjcf(spec), "text");
  return {std::move(spec), std::move(engine)};
}

/// What diagnosis says of a wrong specification.
inline Diagnosis Explain(const DiagnosedRobot& robot, const RobotSpec& wrong,
                         const DiagnosisOptions& options = {}) {
  return Diagnose(RobotModel(wrong), *robot.engine, "mjcf", options, [](const char*) { return true; });
}

/// Whether nothing is left when what it names is repaired.
inline bool IsRepairedWholly(const Diagnosis& diagnosis) {
  return diagnosis.remaining_constants.empty() && diagnosis.remaining_terms.empty();
}

}  // namespace dexcheck::testing
