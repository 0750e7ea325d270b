#include "harness/descriptions/compiled_inertias.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <sstream>
#include <vector>

#include "controller/model/body_frame.h"
#include "harness/descriptions/join_names.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/own_rows.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;

/// The tensors that a file states, by the engine's body: its bodies are numbered as they come, depth first.
class FullInertias {
 public:
  FullInertias(const MjcfFile& mjcf, const mjModel& engine) : engine_(engine) {
    for (const XMLElement* world : ListChildren(mjcf.root(), "worldbody")) Visit(*world);
    // Elements that make bodies of their own.
    if (number_ + 1 != engine.nbody) tensors_.clear();
  }

  /// Of the body of that name, in its own axes.
  [[nodiscard]] std::optional<Matrix3d> Find(const std::string& name) const {
    const auto found = tensors_.find(FindByName(engine_, mjOBJ_BODY, name));
    return found == tensors_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  void Visit(const XMLElement& parent) {
    for (const XMLElement* body : ListChildren(&parent, "body")) {
      ++number_;
      const XMLElement* const inertial = body->FirstChildElement("inertial");
      std::istringstream numbers(inertial == nullptr ? "" : ReadAttribute(*inertial, "fullinertia"));
      Vector6d I;
      if (numbers >> I[0] >> I[1] >> I[2] >> I[3] >> I[4] >> I[5]) {
        // clang-format off
        tensors_[number_] << I[0], I[3], I[4],
                             I[3], I[1], I[5],
                             I[4], I[5], I[2];
        // clang-format on
      }
      Visit(*body);
    }
  }

  const mjModel& engine_;
  int number_ = 0;
  std::map<int, Matrix3d> tensors_;
};

}  // namespace

std::optional<std::string> TakeCompiledInertias(const MjcfFile& mjcf, const mjModel& engine,
                                                RobotDescription* robot) {
  const FullInertias written(mjcf, engine);
  const RobotDescription compiled = ReadMjcfDescription(engine, mjcf.source());
  const std::vector<LinkPlace> places = PlaceLinks(*robot, compiled);
  std::vector<std::string> names;
  double largest = 0.0;
  for (const LinkPlace& place : places) {
    const bool is_base = place.a < 0;
    Joint* const joint = is_base ? nullptr : &robot->spec.joints[static_cast<size_t>(place.a)];
    MassProperties& own = is_base ? robot->spec.base.body : joint->body;
    // What the compiler changed, along the axes of the description's frame.
    Matrix3d change = Matrix3d::Zero();
    for (const DescribedPart& part : compiled.parts) {
      const std::optional<Matrix3d> tensor = part.joint == place.b ? written.Find(part.name) : std::nullopt;
      if (!tensor) continue;
      const Matrix3d R = (place.X_ab * part.X_iL).linear();
      change += R * (part.body.inertia - *tensor) * R.transpose();
    }
    const MassProperties other =
        ExpressIn(is_base ? compiled.spec.base.body : compiled.spec.joints[static_cast<size_t>(place.b)].body,
                  place.X_ab);
    // Tensors are turned a few times and moved to the common centre of mass.
    const double rounding = 64.0 * std::numeric_limits<double>::epsilon() *
                            (own.inertia.trace() + own.mass * own.com.squaredNorm());
    const bool was_written = (own.inertia + change - other.inertia).norm() <= rounding;
    if (change.norm() <= rounding || !was_written) continue;
    largest = std::max(largest, change.norm() / own.inertia.norm());
    own.inertia += 0.5 * (change + change.transpose());
    names.push_back(is_base ? robot->spec.base.link : joint->link);
  }
  if (names.empty()) return std::nullopt;
  return fmt::format(
      "inertias: MuJoCo's compiler diagonalises fullinertia and is up to {:.0e} off what the file states: "
      "that "
      "difference is the engine's, and terms are with what it made of {}",
      largest, JoinNames(names));
}

}  // namespace dexcheck
