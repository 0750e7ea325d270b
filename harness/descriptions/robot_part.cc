#include "harness/descriptions/robot_part.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/descriptions/alike_names.h"

namespace dexcheck {
namespace {

/// Returns for each joint whether it is `root` or hangs on it.
std::vector<bool> ListSubtree(const RobotSpec& spec, int root) {
  std::vector<bool> is_in(spec.joints.size(), false);
  for (size_t i = 0; i < spec.joints.size(); ++i) {
    const int parent = spec.joints[i].parent;
    is_in[i] = static_cast<int>(i) == root || (parent >= 0 && is_in[static_cast<size_t>(parent)]);
  }
  return is_in;
}

/// Takes a joint out; nothing hangs on it any more.
void EraseJoint(int index, RobotDescription* robot) {
  const auto shift = [&](int* joint) {
    if (*joint > index) --*joint;
  };
  robot->spec.joints.erase(robot->spec.joints.begin() + index);
  robot->joints.erase(robot->joints.begin() + index);
  for (Joint& joint : robot->spec.joints) {
    shift(&joint.parent);
    if (joint.coupling) shift(&joint.coupling->leader);
  }
  for (Frame& frame : robot->spec.frames) shift(&frame.link);
  for (DescribedPart& part : robot->parts) shift(&part.joint);
}

/// Welds a joint's link to what carries it.
void HoldJoint(int index, double value, RobotDescription* robot) {
  RobotSpec& spec = robot->spec;
  const Joint joint = spec.joints[static_cast<size_t>(index)];
  if (joint.type == JointType::kBall)
    throw InputError(spec.source + ": joint " + Quote(joint.name) + ": a ball cannot be held");
  const Pose X_Pi = CalcRowPose(joint, value);
  const auto weld = [&](int* carrier, Pose* X) {
    if (*carrier != index) return;
    *carrier = joint.parent;
    *X = X_Pi * *X;
  };
  for (size_t i = 0; i < spec.joints.size(); ++i) {
    // A joint that follows this one is held with it, and was before.
    if (spec.joints[i].coupling && spec.joints[i].coupling->leader == index) spec.joints[i].coupling.reset();
    weld(&spec.joints[i].parent, &spec.joints[i].X_PB);
  }
  for (Frame& frame : spec.frames) weld(&frame.link, &frame.X_LF);
  for (DescribedPart& part : robot->parts) weld(&part.joint, &part.X_iL);
  EraseJoint(index, robot);
}

/// Leaves a link out with all that it carries; false when there is none.
bool LeaveOut(const std::string& link, RobotDescription* robot) {
  const int root = IndexOf(robot->spec.joints, link, &Joint::link);
  if (root < 0) {
    return std::erase_if(robot->parts, [&](const DescribedPart& part) { return part.name == link; }) > 0;
  }
  const std::vector<bool> is_in = ListSubtree(robot->spec, root);
  const auto is_gone = [&](int joint) { return joint >= 0 && is_in[static_cast<size_t>(joint)]; };
  std::erase_if(robot->parts, [&](const DescribedPart& part) { return is_gone(part.joint); });
  std::erase_if(robot->spec.frames, [&](const Frame& frame) { return is_gone(frame.link); });
  for (Joint& joint : robot->spec.joints) {
    if (joint.coupling && is_gone(joint.coupling->leader)) joint.coupling.reset();
  }
  for (int i = static_cast<int>(is_in.size()) - 1; i >= 0; --i) {
    if (is_gone(i)) EraseJoint(i, robot);
  }
  return true;
}

/// Fixes a floating base where the other robot has its link, in its world.
void FixBase(const RobotDescription& other, RobotDescription* robot) {
  Base& base = robot->spec.base;
  if (base.type != BaseType::kFloating) return;
  base.type = BaseType::kFixed;
  base.X_B0 = Pose::Identity();
  if (other.spec.base.type != BaseType::kFixed) return;
  base.X_B0 = other.spec.base.X_B0;
  for (const DescribedPart& part : other.parts) {
    if (part.joint < 0 && part.name == base.link) base.X_B0 = other.spec.base.X_B0 * part.X_iL;
  }
}

/// Those that only `only` keeps: all joints that are not below it.
void HoldOthers(const std::string& only, const RobotDescription& robot, std::map<std::string, double>* held) {
  int root = IndexOf(robot.spec.joints, only, &Joint::link);
  if (root < 0) root = IndexOf(robot.spec.joints, only, &Joint::name);
  if (root < 0) return;
  const std::vector<bool> is_kept = ListSubtree(robot.spec, root);
  for (size_t i = 0; i < is_kept.size(); ++i) {
    if (!is_kept[i]) held->emplace(robot.spec.joints[i].name, 0.0);
  }
}

/// Joints that follow held ones are held where these put them.
void HoldFollowers(const RobotSpec& spec, std::map<std::string, double>* held) {
  for (const Joint& joint : spec.joints) {
    if (!joint.coupling) continue;
    const auto leader = held->find(spec.joints[static_cast<size_t>(joint.coupling->leader)].name);
    if (leader != held->end())
      held->emplace(joint.name, joint.coupling->multiplier * leader->second + joint.coupling->offset);
  }
}

bool HasLink(const RobotDescription& robot, const std::string& name) {
  return IndexOf(robot.spec.joints, name, &Joint::link) >= 0 ||
         Contains(robot.parts, name, &DescribedPart::name);
}

}  // namespace

void AddHeldJoint(const std::string& text, RobotPart* part) {
  const size_t at = text.find('=');
  double value = 0.0;
  if (at != std::string::npos) {
    const std::optional<double> number = ParseNumber<double>(text.substr(at + 1));
    if (!number || !std::isfinite(*number))
      throw InputError("--lock: must be JOINT or JOINT=VALUE with a number, got " + Quote(text));
    value = *number;
  }
  part->held[text.substr(0, at)] = value;
}

std::vector<std::string> TakePart(const RobotPart& part, RobotDescription* a, RobotDescription* b,
                                  int* held) {
  const std::vector<std::string> of_b = ListJointNames(*b);
  std::vector<std::string> notes = TakeJointNames(*a, b);
  // Either file's name of a joint may be given.
  const auto translate = [&](const std::string& name) {
    const int found = IndexOf(of_b, name);
    return found < 0 ? name : b->spec.joints[static_cast<size_t>(found)].name;
  };
  const auto require = [&](bool is_there, const std::string& name, const char* option) {
    if (!is_there)
      throw InputError(std::string(option) + " of " + a->spec.source + " or " + b->spec.source + ", got " +
                       Quote(name));
  };
  std::map<std::string, double> all_held;
  for (const auto& [name, value] : part.held) {
    const std::string joint = translate(name);
    require(IndexOf(a->spec.joints, joint, &Joint::name) >= 0 ||
                IndexOf(b->spec.joints, joint, &Joint::name) >= 0,
            name, "--lock: must be a joint");
    all_held.emplace(joint, value);
  }
  for (const std::string& link : part.left_out)
    require(HasLink(*a, link) || HasLink(*b, link), link,
            "--ignore: must be armature, damping, friction, coupling, effort, or a link");
  if (!part.only.empty()) {
    const std::string only = translate(part.only);
    const auto has = [&](const RobotDescription& robot) {
      return IndexOf(robot.spec.joints, only, &Joint::link) >= 0 ||
             IndexOf(robot.spec.joints, only, &Joint::name) >= 0;
    };
    require(has(*a) || has(*b), part.only, "--only: must be a link or joint");
    for (const RobotDescription* robot : {a, b}) HoldOthers(only, *robot, &all_held);
  }
  if (part.fixes_base || !part.only.empty()) {
    FixBase(*b, a);
    FixBase(*a, b);
    notes.push_back("base: held where it is");
  }
  std::vector<std::string> done;
  for (RobotDescription* robot : {a, b}) {
    for (const std::string& link : part.left_out) {
      if (LeaveOut(link, robot)) done.push_back(Quote(link) + " of " + robot->spec.source);
    }
    std::map<std::string, double> own = all_held;
    HoldFollowers(robot->spec, &own);
    for (const auto& [joint, value] : own) {
      const int index = IndexOf(robot->spec.joints, joint, &Joint::name);
      if (index < 0) continue;
      HoldJoint(index, value, robot);
      ++*held;
    }
    FuseParts(robot);
    if (robot->spec.joints.empty() && robot->spec.base.type != BaseType::kFloating)
      throw InputError(robot->spec.source + ": nothing is left that moves");
  }
  if (!all_held.empty()) {
    std::vector<std::string> list;
    list.reserve(all_held.size());
    for (const auto& [joint, value] : all_held) list.push_back(joint + " at " + FormatNumber(value));
    notes.push_back("joints that are held: " + JoinNames(list));
  }
  if (!done.empty()) notes.push_back("left out: " + JoinNames(done));
  return notes;
}

}  // namespace dexcheck
