#include "harness/descriptions/compiled_inertias.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/robot_description.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck {

using tinyxml2::XMLElement;

std::vector<const XMLElement*> ListInertials(const MjcfFile& mjcf, const mjModel& engine) {
  std::vector<const XMLElement*> inertials;
  for (const XMLElement* body : ListBodies(mjcf))
    inertials.push_back(body == nullptr ? nullptr : body->FirstChildElement("inertial"));
  if (static_cast<int>(inertials.size()) != engine.nbody) inertials.clear();
  return inertials;
}

namespace {

/// How far the engine's search for principal axes leaves a tensor at most, kg m^2: it stops at products of
/// 1e-12 kg m^2, six of which have a norm of 2.5e-12.
double BoundDiagonalisation(double size) { return 1e-6 * size + 2.5e-12; }

template <size_t kCount>
std::optional<std::array<double, kCount>> ReadNumbers(const XMLElement& element, const char* attribute) {
  std::istringstream text(ReadAttribute(element, attribute));
  std::array<double, kCount> numbers{};
  for (double& number : numbers) text >> number;
  return text ? std::optional(numbers) : std::nullopt;
}

std::optional<Matrix3d> ReadTensor(const XMLElement& inertial) {
  const auto full = ReadNumbers<6>(inertial, "fullinertia");
  if (full) return ToTensor(Vector6d(full->data()));
  const auto moments = ReadNumbers<3>(inertial, "diaginertia");
  if (moments) return Matrix3d(Vector3d(moments->data()).asDiagonal());
  return std::nullopt;
}

/// Settings of the compiler that change masses and inertias; the last of several elements outweighs others.
struct CompilerSettings {
  explicit CompilerSettings(const XMLElement* root) {
    for (const XMLElement* compiler : ListChildren(root, "compiler")) {
      const auto read = [&](const char* name, double* value) {
        if (const auto number = ReadNumbers<1>(*compiler, name)) *value = number->front();
      };
      read("boundmass", &bound_mass);
      read("boundinertia", &bound_inertia);
      read("settotalmass", &total_mass);
      from_geoms = ReadAttribute(*compiler, "inertiafromgeom", from_geoms ? "true" : "auto") == "true";
      balances = ReadAttribute(*compiler, "balanceinertia", balances ? "true" : "false") == "true";
    }
  }

  double bound_mass = 0.0, bound_inertia = 0.0;
  double total_mass = -1.0;
  bool from_geoms = false, balances = false;
};

/// A change of numbers, named by those of the settings that change such numbers.
void AddChange(const std::string& body, const std::vector<std::string>& settings, std::vector<double> stated,
               std::vector<double> made, double bound, std::vector<CompiledChange>* changes) {
  double error = 0.0;
  for (size_t k = 0; k < stated.size(); ++k) error = std::max(error, std::abs(stated[k] - made[k]));
  if (error <= bound) return;
  const std::string setting = settings.empty() ? "diagonalisation" : JoinNames(settings);
  changes->push_back({body, setting, std::move(stated), std::move(made)});
}

}  // namespace

Vector3d CalcMoments(const Matrix3d& inertia) {
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(0.5 * (inertia + inertia.transpose()),
                                                 Eigen::EigenvaluesOnly)
      .eigenvalues();
}

std::optional<Matrix3d> ReadFullInertia(const XMLElement& inertial, const Matrix3d& compiled) {
  std::optional<Matrix3d> tensor =
      inertial.Attribute("fullinertia") == nullptr ? std::nullopt : ReadTensor(inertial);
  if (!tensor || (*tensor - compiled).norm() > BoundDiagonalisation(tensor->norm())) return std::nullopt;
  return tensor;
}

std::vector<CompiledChange> ListCompiledChanges(const MjcfFile& mjcf, const mjModel& engine) {
  constexpr double kRounding = 64.0 * std::numeric_limits<double>::epsilon();
  const std::vector<const XMLElement*> inertials = ListInertials(mjcf, engine);
  const CompilerSettings compiler(mjcf.root());
  std::vector<CompiledChange> changes;
  for (size_t body = 1; body < inertials.size(); ++body) {
    if (inertials[body] == nullptr) continue;
    const auto id = static_cast<int>(body);
    const std::string name = NameOf(engine, mjOBJ_BODY, id);
    const bool from_geoms = compiler.from_geoms && engine.body_geomnum[id] > 0;
    const auto list = [&](std::vector<std::string> settings) {
      if (from_geoms) settings = {"inertiafromgeom"};
      if (compiler.total_mass > 0.0) settings.emplace_back("settotalmass");
      return settings;
    };
    const auto mass = ReadNumbers<1>(*inertials[body], "mass");
    if (mass) {
      const bool is_bound = mass->front() < compiler.bound_mass;
      AddChange(name, list(is_bound ? std::vector<std::string>{"boundmass"} : std::vector<std::string>{}),
                {mass->front()}, {engine.body_mass[body]}, kRounding * mass->front(), &changes);
    }
    const std::optional<Matrix3d> tensor = ReadTensor(*inertials[body]);
    if (!tensor) continue;
    std::vector<std::string> settings;
    const Vector3d stated = CalcMoments(*tensor);
    if (stated[0] < compiler.bound_inertia) settings.emplace_back("boundinertia");
    const Vector3d bound = stated.cwiseMax(compiler.bound_inertia);
    if (compiler.balances && bound[0] + bound[1] < bound[2]) settings.emplace_back("balanceinertia");
    std::vector<double> made(engine.body_inertia + 3 * body, engine.body_inertia + 3 * body + 3);
    std::ranges::sort(made);
    AddChange(name, list(settings), {stated.begin(), stated.end()}, made, BoundDiagonalisation(stated.norm()),
              &changes);
  }
  return changes;
}

std::optional<std::string> TakeCompiledInertias(const MjcfFile& mjcf, const mjModel& engine,
                                                RobotDescription* robot) {
  const std::vector<const XMLElement*> inertials = ListInertials(mjcf, engine);
  const RobotDescription compiled = ReadMjcfDescription(engine, mjcf.source());
  const std::vector<LinkPlace> places = PlaceLinks(*robot, compiled);
  std::vector<std::string> names;
  double largest = 0.0;
  for (const LinkPlace& place : places) {
    MassProperties& own = BodyOf(robot->spec, place.a);
    // The compiler's change, along the axes of the description's frame.
    Matrix3d change = Matrix3d::Zero();
    for (const DescribedPart& part : compiled.parts) {
      const auto body = static_cast<size_t>(FindByName(engine, mjOBJ_BODY, part.name));
      if (part.joint != place.b || body >= inertials.size() || inertials[body] == nullptr) continue;
      const std::optional<Matrix3d> tensor = ReadFullInertia(*inertials[body], part.body.inertia);
      if (!tensor) continue;
      const Matrix3d R = (place.X_ab * part.X_iL).linear();
      change += R * (part.body.inertia - *tensor) * R.transpose();
    }
    const MassProperties other = ExpressIn(BodyOf(compiled.spec, place.b), place.X_ab);
    // Tensors are turned a few times and moved to the common centre of mass.
    const double rounding = 64.0 * std::numeric_limits<double>::epsilon() *
                            (own.inertia.trace() + own.mass * own.com.squaredNorm());
    const bool was_written = (own.inertia + change - other.inertia).norm() <= rounding;
    if (change.norm() <= rounding || !was_written) continue;
    largest = std::max(largest, change.norm() / own.inertia.norm());
    own.inertia += 0.5 * (change + change.transpose());
    names.push_back(LinkOf(robot->spec, place.a));
  }
  if (names.empty()) return std::nullopt;
  return fmt::format(
      "inertias: MuJoCo's compiler diagonalises fullinertia, which changes it by up to {:.0e}; the terms use "
      "its result for {}",
      largest, JoinNames(names));
}

}  // namespace dexcheck
