// The worst disagreement of an analytic model with an engine's: compare_robot ROBOT.toml ROBOT.xml

#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

#include "controller/model/parameter_reader.h"
#include "harness/comparison/consistency.h"
#include "harness/engine/adapter.h"
#include "harness/engine/engine.h"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: compare_robot ROBOT.toml ROBOT.xml\n";
    return 2;
  }
  std::ifstream file(argv[1]);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const dexcheck::RobotModel model = dexcheck::ParseRobotModel(text, argv[1]);
  const dexcheck::MjModelPtr engine = dexcheck::LoadMjcf(argv[2]);
  const dexcheck::Adapter adapter(model, *engine, argv[2]);

  dexcheck::ConsistencyOptions options;
  options.samples = 100;
  const dexcheck::ConsistencyResult result =
      dexcheck::CheckConsistency(adapter, options, [](long) { return true; });
  const dexcheck::CheckRecord* worst = &result.terms.front();
  for (const dexcheck::CheckRecord& term : result.terms) {
    if (term.worst / term.bound > worst->worst / worst->bound) worst = &term;
  }
  std::cout << (result.Agrees() ? "agree" : "disagree") << ", worst " << worst->name << " " << worst->worst
            << " of " << worst->bound << "\n";
  return result.Agrees() ? 0 : 1;
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 2;
}
