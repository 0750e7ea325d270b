// Every number of a parameter file, changed by 0.1 %, must be found and the part of the robot that it belongs
// to named.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <toml++/toml.h>

#include <fstream>
#include <set>
#include <sstream>

#include "controller/common/errors.h"
#include "controller/model/parameter_reader.h"
#include "harness/comparison/consistency.h"
#include "harness/engine/engine.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::negative_control_test {
namespace {

constexpr double kChange = 1e-3;
constexpr long kSamples = 3;

struct Leaf {
  std::string key;
  double value;
  size_t begin;  // of the number's text in the file
  size_t end;
};

std::string ReadText(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

size_t OffsetOf(const std::string& text, const toml::source_position& position) {
  size_t offset = 0;
  for (toml::source_index line = 1; line < position.line; ++line) offset = text.find('\n', offset) + 1;
  return offset + position.column - 1;
}

void CollectNumbers(const toml::node& node, const std::string& key, const std::string& text,
                    std::vector<Leaf>* leaves) {
  if (const toml::table* table = node.as_table()) {
    for (const auto& [name, child] : *table)
      CollectNumbers(child, key + "." + std::string(name.str()), text, leaves);
  } else if (const toml::array* array = node.as_array()) {
    for (size_t i = 0; i < array->size(); ++i) {
      CollectNumbers((*array)[i], fmt::format("{}[{}]", key, i), text, leaves);
    }
  } else if (node.is_number()) {
    const size_t begin = OffsetOf(text, node.source().begin);
    const size_t end = text.find_first_of(" ,]}\n#", begin);
    leaves->push_back({key, *node.value<double>(), begin, end});
  }
}

/// The robot with one number changed by 0.1 %: up, or down where up would make an inertia impossible.
RobotModel ReadChanged(const std::string& text, const Leaf& leaf) {
  const auto replace = [&](double factor) {
    std::string changed = text;
    return changed.replace(leaf.begin, leaf.end - leaf.begin, fmt::format("{:.17g}", leaf.value * factor));
  };
  try {
    return ParseRobotModel(replace(1.0 + kChange), "mutant");
  } catch (const InputError&) {
    return ParseRobotModel(replace(1.0 - kChange), "mutant");
  }
}

/// Names of the links, joints, frames, wheels and object whose numbers differ between two specifications.
std::set<std::string> FindChangedParts(const RobotSpec& a, const RobotSpec& b) {
  std::set<std::string> parts;
  const auto differs = [](const MassProperties& x, const MassProperties& y) {
    return x.mass != y.mass || x.com != y.com || x.inertia != y.inertia;
  };
  for (size_t i = 0; i < a.joints.size(); ++i) {
    const Joint& x = a.joints[i];
    const Joint& y = b.joints[i];
    const bool changed = x.mdh.alpha != y.mdh.alpha || x.mdh.a != y.mdh.a || x.mdh.q != y.mdh.q ||
                         x.mdh.d != y.mdh.d || x.X_PB.matrix() != y.X_PB.matrix() || x.lower != y.lower ||
                         x.upper != y.upper || x.damping != y.damping || x.armature != y.armature ||
                         differs(x.body, y.body);
    if (changed) parts.insert({x.name, x.link});
  }
  for (size_t i = 0; i < a.frames.size(); ++i) {
    if (a.frames[i].X_LF.matrix() != b.frames[i].X_LF.matrix() ||
        a.frames[i].sphere_radius != b.frames[i].sphere_radius) {
      parts.insert(a.frames[i].name);
    }
  }
  const Base& x = a.base;
  const Base& y = b.base;
  if (differs(x.body, y.body) || x.X_B0.matrix() != y.X_B0.matrix()) parts.insert(x.link);
  if (x.wheel_radius != y.wheel_radius || x.wheel_distance != y.wheel_distance ||
      x.wheel.mass != y.wheel.mass || x.wheel.spin_inertia != y.wheel.spin_inertia ||
      x.wheel.transverse_inertia != y.wheel.transverse_inertia || x.wheel.armature != y.wheel.armature ||
      x.wheel.damping != y.wheel.damping) {
    parts.insert({x.wheel_joint_right, x.link});
  }
  if (a.gravity != b.gravity) parts.insert("robot");
  if (a.object && (differs(a.object->body, b.object->body) || a.object->friction != b.object->friction)) {
    parts.insert({a.object->name, "tip"});
  }
  return parts;
}

/// Lists the parts that a person reads first: those of findings, and of each failed term's failure nearest
/// the base.
std::string ListNamedParts(const ConsistencyResult& result, const RobotModel& model) {
  std::string text;
  for (const ConstantFinding& finding : result.constants.findings) text += finding.where + "; ";
  for (const CheckRecord& record : result.terms) {
    if (record.failed) text += Describe(record.first_failure, model, model.num_base_velocities()) + "; ";
  }
  return text;
}

struct Files {
  const char* name;
  const char* robot;
  const char* mjcf;
};

class NegativeControl : public ::testing::TestWithParam<Files> {};

TEST_P(NegativeControl, EveryNumberIsFoundAndNamed) {
  const std::string path = SourcePath(GetParam().robot);
  const std::string text = ReadText(path);
  const RobotModel model = ReadRobotModel(path);
  const MjModelPtr engine = LoadMjcf(SourcePath(GetParam().mjcf));
  ConsistencyOptions options;
  options.samples = kSamples;
  const auto go_on = [](long) { return true; };
  ASSERT_TRUE(CheckConsistency(Adapter(model, *engine, "mjcf"), options, go_on).Agrees());

  std::vector<Leaf> leaves;
  CollectNumbers(toml::parse(text), "", text, &leaves);
  int changed = 0;
  for (const Leaf& leaf : leaves) {
    if (leaf.value == 0.0) continue;  // 0.1 % of nothing
    SCOPED_TRACE(leaf.key);
    const RobotModel mutant = ReadChanged(text, leaf);
    const std::set<std::string> parts = FindChangedParts(model.spec(), mutant.spec());
    ASSERT_FALSE(parts.empty()) << "the number has no effect on the model";
    ++changed;

    const Adapter adapter(mutant, *engine, "mjcf");
    const ConsistencyResult result = CheckConsistency(adapter, options, go_on);
    EXPECT_FALSE(result.Agrees());
    const std::string named = ListNamedParts(result, mutant);
    const bool names_one = std::ranges::any_of(
        parts, [&](const std::string& part) { return named.find(part) != std::string::npos; });
    EXPECT_TRUE(names_one) << "named: " << named;
  }
  EXPECT_GT(changed, 50);
}

INSTANTIATE_TEST_SUITE_P(
    Robots, NegativeControl,
    ::testing::Values(Files{"Assistant", "/controller/parameters/assistant_robot.toml", "/mjcf/scene.xml"},
                      Files{"Panda", "/controller/parameters/panda.toml", "/mjcf/panda.xml"}),
    [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace dexcheck::testing::negative_control_test
