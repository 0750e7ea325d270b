#include "harness/descriptions/compiled_inertias.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <sstream>

#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "harness/descriptions/fault_search.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/engine/engine.h"
#include "harness/engine/xml.h"

namespace dexcheck {

using tinyxml2::XMLElement;

std::vector<const XMLElement*> ListInertials(const MjcfFile& mjcf, const mjModel& engine) {
  std::vector<const XMLElement*> inertials = {nullptr};
  for (const XMLElement* world : ListChildren(static_cast<const XMLElement*>(mjcf.root()), "worldbody")) {
    VisitElements(world, [&](const XMLElement* element) {
      if (std::string_view(element->Name()) == "body")
        inertials.push_back(element->FirstChildElement("inertial"));
    });
  }
  if (static_cast<int>(inertials.size()) != engine.nbody) inertials.clear();
  return inertials;
}

std::optional<Matrix3d> ReadFullInertia(const XMLElement& inertial) {
  std::istringstream numbers(ReadAttribute(inertial, "fullinertia"));
  std::array<double, 6> I{};
  if (!(numbers >> I[0] >> I[1] >> I[2] >> I[3] >> I[4] >> I[5])) return std::nullopt;
  return MakeTensor(I);
}
std::optional<std::string> TakeCompiledInertias(const MjcfFile& mjcf, const mjModel& engine,
                                                RobotDescription* robot) {
  const std::vector<const XMLElement*> inertials = ListInertials(mjcf, engine);
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
      const auto body = static_cast<size_t>(FindByName(engine, mjOBJ_BODY, part.name));
      if (part.joint != place.b || body >= inertials.size() || inertials[body] == nullptr) continue;
      const std::optional<Matrix3d> tensor = ReadFullInertia(*inertials[body]);
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
      "that difference is the engine's, and terms are with what it made of {}",
      largest, JoinNames(names));
}

}  // namespace dexcheck
