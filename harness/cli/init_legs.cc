#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "harness/cli/init_stance.h"
#include "harness/engine/xml.h"

namespace dexcheck::cli {

using tinyxml2::XMLElement;

namespace {

bool IsBall(const DescribedShape& shape) {
  const double ball = kPi / 6.0 * (shape.high - shape.low).prod();
  return std::abs(ball - shape.volume) < 1e-6 * ball;
}

}  // namespace

std::vector<int> FindLegs(const RobotDescription& robot) {
  std::vector<Pose> X_0;    // of each joint's frame, all at zero
  std::vector<int> length;  // joints from the base
  std::set<int> ends;
  const auto find = [&](int joint) { return joint < 0 ? Pose::Identity() : X_0[static_cast<size_t>(joint)]; };
  for (const Joint& joint : robot.spec.joints) {
    const MdhRow& row = joint.mdh;
    ends.erase(joint.parent);
    ends.insert(static_cast<int>(X_0.size()));
    X_0.push_back(find(joint.parent) * joint.X_PB * CalcMdhTransform(row.alpha, row.a, row.q, row.d));
    length.push_back(joint.parent < 0 ? 1 : length[static_cast<size_t>(joint.parent)] + 1);
  }
  double ground = 0.0;
  std::map<int, double> lowest;  // by joint
  for (const DescribedPart& part : robot.parts) {
    const Pose X_0L = find(part.joint) * part.X_iL;
    double z = X_0L.translation().z();
    for (const DescribedShape& shape : part.shapes) {
      const Vector3d half = 0.5 * (shape.high - shape.low);
      z = std::min(z, (X_0L * Vector3d(shape.low + half)).z() - X_0L.linear().row(2).cwiseAbs().dot(half));
    }
    lowest[part.joint] = std::min(z, lowest.try_emplace(part.joint, z).first->second);
    ground = std::min(ground, z);
  }
  constexpr double kNear = 0.05;  // m
  constexpr int kLeast = 3;       // joints
  std::vector<int> legs;
  for (const int end : ends) {
    if (lowest[end] < ground + kNear) legs.push_back(end);
  }
  const auto count = [&](int leg) { return length[static_cast<size_t>(leg)]; };
  const bool is_alike = std::ranges::all_of(
      legs, [&](int leg) { return count(leg) >= kLeast && count(leg) == count(legs[0]); });
  if (legs.size() < 2 || !is_alike || lowest[-1] < ground + kNear) legs.clear();
  return legs;
}

void AddLegShapes(const RobotDescription& robot, const std::vector<int>& legs, MjcfFile* mjcf) {
  for (const int leg : legs) {
    XMLElement* body = nullptr;
    VisitElements(mjcf->root(), [&](XMLElement* element) {
      if (ReadAttribute(*element, "name") == robot.spec.joints[static_cast<size_t>(leg)].link &&
          std::string_view(element->Name()) == "body")
        body = element;
    });
    if (body == nullptr) continue;
    const auto write = [](const auto& numbers) { return fmt::format("{:.12g}", fmt::join(numbers, " ")); };
    const auto add = [&](const char* type, const Vector3d& size, const Pose& X_iL, const Vector3d& p_L) {
      XMLElement* const geom = body->InsertNewChildElement("geom");
      const Eigen::Quaterniond q(X_iL.linear());
      geom->SetAttribute("type", type);
      geom->SetAttribute("size", write(size).c_str());
      geom->SetAttribute("pos", write(Vector3d(X_iL * p_L)).c_str());
      geom->SetAttribute("quat", write(std::array{q.w(), q.x(), q.y(), q.z()}).c_str());
      geom->SetAttribute("mass", 0);
    };
    bool has_shape = false;
    Vector3d farthest = Vector3d::Zero();
    for (const DescribedPart& part : robot.parts) {
      if (part.joint != leg) continue;
      if (part.X_iL.translation().norm() > farthest.norm()) farthest = part.X_iL.translation();
      for (const DescribedShape& shape : part.shapes) {
        if (shape.volume == 0.0) continue;
        const Vector3d half = 0.5 * (shape.high - shape.low);
        add(IsBall(shape) ? "sphere" : "box", half, part.X_iL, shape.low + half);
        has_shape = true;
      }
    }
    if (!has_shape) add("sphere", Vector3d::Constant(kAddedRadius), Pose::Identity(), farthest);
  }
}

}  // namespace dexcheck::cli
